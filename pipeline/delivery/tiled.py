"""Coding in tiles that can be decoded independently, with or without a coarse base layer (SPEC 6.5)."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.delivery.coding import Images, Received
from pipeline.delivery.protected import protect, unprotect
from pipeline.types import BoolArray, ByteArray

TILE = 32
"""Side of a tile in pixels."""
_LENGTH_BYTES = 4


@dataclass(frozen=True, slots=True)
class Tiled:
    """RVL depth tiles, then JPEG colour tiles; their lengths and the base layer are protected.

    Depth tiles are not coded as differences to the base layer, which would take more bytes, as its depths
    are quantised. Rows alternate in direction, so that neighbours in the stream are neighbours in the image.
    All depth comes before all colour, and consecutive tiles are far apart in the image.
    """

    name: str
    title: str
    base: bool
    """Whether there is a base layer, which replaces lost tiles."""
    repair_every: int
    """Interval, in packets, between the packets that repair the protected part."""

    def encode(self, images: Images, packet_bytes: int) -> bytes:
        """Encode as ``Coding.encode``; whole packets unless ``packet_bytes`` is very small or large."""
        from pipeline.delivery import coarse, rvl
        from pipeline.delivery.pictures import write_scan

        areas = list(_areas(images.depth.shape))
        streams = [rvl.encode(_to_and_fro(images.depth[area])) for area in areas]
        streams += [write_scan(images.rgb[area]) for area in areas]
        protected = [rvl.encode(np.array([len(stream) for stream in streams], np.uint16))]
        if self.base:
            protected += [coarse.write_depth(images.depth), coarse.write_color(images.rgb)]
        body = b"".join(streams[index] for index in _order(len(areas)))
        return protect(_joined(protected), body, packet_bytes, self.repair_every)

    def decode(
        self, data: ByteArray, arrived: BoolArray, shape: tuple[int, int], packet_bytes: int
    ) -> Received:
        """Decode as ``Coding.decode``; an incomplete depth tile gives the values before its first gap."""
        from pipeline.delivery import coarse, rvl
        from pipeline.delivery.pictures import read_scan

        received = Received.nothing(shape)
        parts = unprotect(data, arrived, packet_bytes, self.repair_every)
        if parts.base is None:
            return received
        protected = _split(parts.base)
        if self.base:
            received.coarse[:] = coarse.read_depth(protected[1], shape)
            received.rgb[:] = coarse.read_color(protected[2], shape)
            received.rgb_known[:] = True

        areas = list(_areas(shape))
        lengths = rvl.decode(np.frombuffer(protected[0], np.uint8), 2 * len(areas))
        for index, stream in _streams(parts.body, parts.arrived, lengths, _order(len(areas))):
            area = areas[index % len(areas)]
            tile_shape = received.depth[area].shape
            if index < len(areas):
                values = rvl.decode_start(stream, tile_shape[0] * tile_shape[1])
                _fill_start(received.depth[area], values)
                _fill_start(received.coarse[area], np.zeros_like(values))
            elif stream.size == lengths[index]:
                received.rgb[area] = read_scan(stream.tobytes(), tile_shape)
                received.rgb_known[area] = True
        return received


def _areas(shape: tuple[int, ...]) -> Iterator[tuple[slice, slice]]:
    """Yield the areas of the tiles, row after row; those at the right and lower edge may be smaller."""
    for top in range(0, shape[0], TILE):
        for left in range(0, shape[1], TILE):
            yield slice(top, min(top + TILE, shape[0])), slice(left, min(left + TILE, shape[1]))


def _order(count: int) -> NDArray[np.int64]:
    """Return (2 * count,) tiles in order of sending, depth before colour, in steps of the golden section."""
    step = round(0.382 * count) or 1
    while np.gcd(step, count) != 1:
        step += 1
    spread = np.arange(count) * step % count
    return np.concatenate([spread, count + spread])


def _streams(
    body: ByteArray, arrived: BoolArray, lengths: NDArray[np.uint16], order: NDArray[np.int64]
) -> Iterator[tuple[int, ByteArray]]:
    """Yield each tile that has arrived at least in part, with its bytes before the first gap."""
    ends = np.cumsum(lengths[order], dtype=np.int64)
    starts = ends - lengths[order]
    gaps = np.append(np.flatnonzero(~arrived), arrived.size)
    known_ends = np.minimum(ends, gaps[np.searchsorted(gaps, starts)])
    for index, start, end in zip(order.tolist(), starts.tolist(), known_ends.tolist(), strict=True):
        if end > start:
            yield index, body[start:end]


def _to_and_fro(tile: NDArray[np.uint16]) -> NDArray[np.uint16]:
    """Return a tile with every second row reversed."""
    turned = tile.copy()
    turned[1::2] = turned[1::2, ::-1]
    return turned


def _fill_start(tile: NDArray[np.uint16], values: NDArray[np.uint16]) -> None:
    """Write the first values of ``_to_and_fro`` at their positions in the tile."""
    turned = _to_and_fro(tile)
    turned.reshape(-1)[: values.size] = values
    tile[:] = _to_and_fro(turned)


def _joined(parts: list[bytes]) -> bytes:
    return b"".join(len(part).to_bytes(_LENGTH_BYTES, "big") + part for part in parts)


def _split(data: bytes) -> list[bytes]:
    parts = []
    position = 0
    while position < len(data):
        start = position + _LENGTH_BYTES
        position = start + int.from_bytes(data[position:start], "big")
        parts.append(data[start:position])
    return parts
