"""Coding in tiles that can be decoded independently, with or without a coarse base layer (SPEC 6.5)."""

from __future__ import annotations

import zlib
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from packetmesh.errors import InputError
from pipeline.delivery.coding import Images, Received, areas_of
from pipeline.delivery.protected import protect, unprotect
from pipeline.types import BoolArray, ByteArray, IntArray

TILE = 32
"""Side of a depth tile in pixels."""
_LENGTH_BYTES = 4
SEAL_BYTES = 1
_CHECK_BYTES = 4


@dataclass(frozen=True, slots=True)
class Colors:
    """Coding of colour tiles."""

    side_px: int
    write: Callable[[ByteArray], bytes]
    """Encodes an (h, w, 3) RGB tile."""
    read: Callable[[bytes, tuple[int, int]], ByteArray]
    """Decodes it, given its (h, w)."""


@dataclass(frozen=True, slots=True)
class Pieces:
    """A node's images as tiles, before they are joined to a stream."""

    base: bytes
    """The protected part."""
    depth: tuple[bytes, ...]
    """Sealed streams of the depth tiles, row after row; empty where nothing was measured."""
    color: tuple[bytes, ...]
    """Sealed streams of the colour tiles, which may be larger."""


@dataclass(frozen=True, slots=True)
class Tiled:
    """Exact depth tiles, then colour tiles; their lengths, the levels of depth and the base layer are
    protected.

    Depth tiles are not coded as differences to the base layer, which would take more bytes, as its depths
    are quantised. All depth comes before all colour, and consecutive tiles are far apart in the image.
    """

    name: str
    title: str
    colors: Colors
    base: bool
    """Whether there is a base layer, which replaces lost tiles."""
    repair_every: int
    """Interval, in packets, between the packets that repair the protected part."""

    def encode(self, images: Images, packet_bytes: int) -> bytes:
        """Encode as ``Coding.encode``; whole packets unless ``packet_bytes`` is very small or large."""
        return self.joined(self.pieces(images), packet_bytes)

    def pieces(self, images: Images) -> Pieces:
        """Encode the images' tiles and the protected part."""
        from pipeline.delivery import coarse, levels, rvl

        areas = areas_of(images.depth.shape, TILE)
        color_areas = areas_of(images.depth.shape, self.colors.side_px)
        depth = levels.encode(images.depth, areas)
        tiles = [*depth.tiles, *(self.colors.write(images.rgb[area]) for area in color_areas)]
        streams = [_sealed(tile, index) if tile else b"" for index, tile in enumerate(tiles)]
        lengths = np.array([len(stream) for stream in streams], np.uint16)
        protected = [rvl.encode(lengths), depth.header]
        if self.base:
            protected += [coarse.write_depth(images.depth), coarse.write_color(images.rgb)]
        base = _joined(protected)
        base += zlib.crc32(base).to_bytes(_CHECK_BYTES, "big")
        return Pieces(base, tuple(streams[: len(areas)]), tuple(streams[len(areas) :]))

    def joined(
        self,
        pieces: Pieces,
        packet_bytes: int,
        leave_out: BoolArray | None = None,
        depth_order: IntArray | None = None,
    ) -> bytes:
        """Join tiles to the bytes of a frame, as ``Coding.encode`` returns them.

        Args:
            pieces: the tiles.
            packet_bytes: as in ``encode``.
            leave_out: (T,) True for tiles that are not sent, depth before colour; None sends all.
            depth_order: the depth tiles in order of sending; None takes ``own_order``.
        """
        streams = [*pieces.depth, *pieces.color]
        order = _order(len(pieces.depth), len(pieces.color), depth_order)
        body = b"".join(streams[index] for index in order if leave_out is None or not leave_out[index])
        return protect(pieces.base, body, packet_bytes, self.repair_every)

    def decode(
        self,
        data: ByteArray,
        arrived: BoolArray,
        shape: tuple[int, int],
        packet_bytes: int,
        leave_out: BoolArray | None = None,
        depth_order: IntArray | None = None,
    ) -> Received:
        """Decode as ``Coding.decode``; an incomplete depth tile gives the depths before its first gap.

        Bytes that are damaged, or another tile's, are noticed in the protected part, and in 255 of 256 tiles
        that are whole; they count as lost. The first bytes of a tile that is cut have no check. Of a tile
        that the node leaves out, there is what the base layer has; ``leave_out`` and ``depth_order`` are as
        in ``joined``.

        Raises:
            InputError: the depths are of another version of the coding.
        """
        from pipeline.delivery import coarse, levels, rvl

        received = Received.nothing(shape)
        parts = unprotect(data, arrived, packet_bytes, self.repair_every)
        if parts.base is None:
            return received
        base, check = parts.base[:-_CHECK_BYTES], parts.base[-_CHECK_BYTES:]
        if zlib.crc32(base) != int.from_bytes(check, "big"):
            return received
        protected = _split(base)
        if self.base:
            received.coarse[:] = coarse.read_depth(protected[2], shape)
            received.rgb[:] = coarse.read_color(protected[3], shape)
            received.rgb_known[:] = True

        areas, color_areas = areas_of(shape, TILE), areas_of(shape, self.colors.side_px)
        lengths = rvl.decode(np.frombuffer(protected[0], np.uint8), len(areas) + len(color_areas))
        listed = levels.read_header(protected[1])
        for area, length in zip(areas, lengths[: len(areas)], strict=True):
            if length == 0:  # nothing was measured there
                received.coarse[area] = 0
        if leave_out is not None:
            lengths = np.where(leave_out, 0, lengths).astype(np.uint16)
        order = _order(len(areas), len(color_areas), depth_order)
        for index, stream in _streams(parts.body, parts.arrived, lengths, order):
            whole = stream.size == lengths[index]
            if whole and not _is_sealed(stream, index):
                continue
            tile = stream[:-SEAL_BYTES] if whole else stream
            with suppress(InputError):  # damaged, though its seal fits or is cut off
                if index < len(areas):
                    area = areas[index]
                    values = levels.decode_tile(tile, listed, received.depth[area].shape)
                    _fill_start(received.depth[area], values)
                    _fill_start(received.coarse[area], np.zeros_like(values))
                elif whole:
                    area = color_areas[index - len(areas)]
                    received.rgb[area] = self.colors.read(tile.tobytes(), received.depth[area].shape)
                    received.rgb_known[area] = True
        return received


def _order(depth_count: int, color_count: int, depth_order: IntArray | None) -> NDArray[np.int64]:
    """Return all tiles in order of sending, depth before colour."""
    depth = own_order(depth_count) if depth_order is None else depth_order
    return np.concatenate([depth, depth_count + own_order(color_count)])


def own_order(count: int) -> NDArray[np.int64]:
    """Return a number of tiles in the coding's own order, in steps of the golden section."""
    step = round(0.382 * count) or 1
    while np.gcd(step, count) != 1:
        step += 1
    return np.arange(count) * step % count


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


def _fill_start(tile: NDArray[np.uint16], values: NDArray[np.uint16]) -> None:
    """Write the first values of a tile, row after row, into its area of an image."""
    first = tile.ravel()
    first[: values.size] = values
    tile[:] = first.reshape(tile.shape)


def _sealed(tile: bytes, index: int) -> bytes:
    """Return a tile's bytes and a check of them and of its place in the image."""
    return tile + bytes([zlib.crc32(tile, index) & 255])


def _is_sealed(stream: ByteArray, index: int) -> bool:
    return zlib.crc32(stream[:-SEAL_BYTES].tobytes(), index) & 255 == stream[-1]


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


def _write_jpeg(rgb: ByteArray) -> bytes:
    from pipeline.delivery.pictures import write_scan

    return write_scan(rgb)


def _read_jpeg(scan: bytes, shape: tuple[int, int]) -> ByteArray:
    from pipeline.delivery.pictures import read_scan

    return read_scan(scan, shape)


def _write_avif(rgb: ByteArray) -> bytes:
    from pipeline.delivery.pictures import write_av1

    return write_av1(rgb)


def _read_avif(frame: bytes, shape: tuple[int, int]) -> ByteArray:
    from pipeline.delivery.pictures import read_av1

    return read_av1(frame, shape)


JPEG = Colors(32, _write_jpeg, _read_jpeg)
AVIF = Colors(64, _write_avif, _read_avif)
"""Two thirds to nine tenths of the bytes of ``JPEG`` at the same similarity, and ten times its encoding."""
