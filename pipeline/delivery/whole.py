"""Coding of depth and colour as two common files, each lost if a byte is missing (SPEC 6.5)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from pipeline.delivery.coding import DepthArray, Images, Received
from pipeline.types import BoolArray, ByteArray

_LENGTH_BYTES = 4


@dataclass(frozen=True, slots=True)
class Format:
    """Encoder and decoder of one image."""

    write: Callable[[Any], bytes]
    read: Callable[[bytes, tuple[int, int]], Any]
    """Decodes the stream, given the image's (H, W)."""


@dataclass(frozen=True, slots=True)
class Whole:
    """A depth stream, then a colour stream.

    The length of the depth stream is in front of it and that of the colour stream after it, so that either
    can be found and decoded without the other.
    """

    name: str
    title: str
    depth: Format
    color: Format

    def encode(self, images: Images, packet_bytes: int) -> bytes:
        """Encode as ``Coding.encode``; ``packet_bytes`` has no effect."""
        depth, color = self.depth.write(images.depth), self.color.write(images.rgb)
        lengths = [len(stream).to_bytes(_LENGTH_BYTES, "big") for stream in (depth, color)]
        return lengths[0] + depth + color + lengths[1]

    def decode(
        self, data: ByteArray, arrived: BoolArray, shape: tuple[int, int], packet_bytes: int
    ) -> Received:
        """Decode as ``Coding.decode``; a stream with a gap is not decoded."""
        received = Received.nothing(shape)
        head, tail = slice(0, _LENGTH_BYTES), slice(data.size - _LENGTH_BYTES, data.size)
        if arrived[head].all():
            depth = slice(head.stop, head.stop + _number(data[head]))
            if arrived[depth].all():
                received.depth[:] = self.depth.read(data[depth].tobytes(), shape)
        if arrived[tail].all():
            color = slice(tail.start - _number(data[tail]), tail.start)
            if arrived[color].all():
                received.rgb[:] = self.color.read(data[color].tobytes(), shape)
                received.rgb_known[:] = True
        return received


def _number(data: ByteArray) -> int:
    return int.from_bytes(data.tobytes(), "big")


def _write_png(image: Any) -> bytes:
    from pipeline.delivery.pictures import write_png

    return write_png(image)


def _write_jpeg(rgb: ByteArray) -> bytes:
    from pipeline.delivery.pictures import write_jpeg

    return write_jpeg(rgb)


def _read_picture(stream: bytes, shape: tuple[int, int]) -> Any:
    from pipeline.delivery.pictures import read_picture

    return read_picture(stream)


def _write_rvl(depth: DepthArray) -> bytes:
    from pipeline.delivery import rvl

    return rvl.encode(depth)


def _read_rvl(stream: bytes, shape: tuple[int, int]) -> DepthArray:
    from pipeline.delivery import rvl

    return rvl.decode(np.frombuffer(stream, np.uint8), shape[0] * shape[1]).reshape(shape)


PNG = Format(_write_png, _read_picture)
JPEG = Format(_write_jpeg, _read_picture)
RVL = Format(_write_rvl, _read_rvl)
