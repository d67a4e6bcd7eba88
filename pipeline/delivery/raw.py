"""Coding of images pixel after pixel, in which every received byte can be used (SPEC 6.1, 6.4)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from pipeline.delivery.coding import Images, Received
from pipeline.types import BoolArray, ByteArray

_DEPTH_BYTES = 2
_COLOR_BYTES = 3

PixelOrder = NDArray[np.int32]
"""(H * W,) raster indices of the pixels in the order of sending."""


@dataclass(frozen=True, slots=True)
class Raw:
    """Depth as a 16-bit PGM file and colour as a PPM file, with the pixels of both in one order."""

    name: str
    title: str
    order: Callable[[tuple[int, int]], PixelOrder]
    """Returns the pixel order for an image of (H, W) pixels."""
    color_first: bool = False

    def encode(self, images: Images, packet_bytes: int) -> bytes:
        """Encode as ``Coding.encode``; ``packet_bytes`` has no effect."""
        shape = (images.depth.shape[0], images.depth.shape[1])
        order = self.order(shape)
        depth = _depth_header(shape) + images.depth.reshape(-1)[order].astype(">u2").tobytes()
        color = _color_header(shape) + images.rgb.reshape(-1, _COLOR_BYTES)[order].tobytes()
        return color + depth if self.color_first else depth + color

    def decode(
        self, data: ByteArray, arrived: BoolArray, shape: tuple[int, int], packet_bytes: int
    ) -> Received:
        """Decode as ``Coding.decode``: a pixel is known when all of its bytes arrived."""
        order = self.order(shape)
        depth_file = len(_depth_header(shape)) + _DEPTH_BYTES * order.size
        color_file = len(_color_header(shape)) + _COLOR_BYTES * order.size
        depth = slice(color_file if self.color_first else 0, None)
        color = slice(0 if self.color_first else depth_file, None)
        received = Received.nothing(shape)

        pixels, known = _pixels(data[depth], arrived[depth], len(_depth_header(shape)), order, _DEPTH_BYTES)
        received.depth.reshape(-1)[known] = pixels.view(">u2")[:, 0]
        pixels, known = _pixels(data[color], arrived[color], len(_color_header(shape)), order, _COLOR_BYTES)
        received.rgb.reshape(-1, _COLOR_BYTES)[known] = pixels
        received.rgb_known.reshape(-1)[known] = True
        return received


@lru_cache(maxsize=4)
def raster(shape: tuple[int, int]) -> PixelOrder:
    """Return the order row after row."""
    return np.arange(shape[0] * shape[1], dtype=np.int32)


@lru_cache(maxsize=4)
def spread_rows(shape: tuple[int, int]) -> PixelOrder:
    """Return the rows ordered by their number with its bits reversed (0, 4, 2, 6, 1, ...).

    The rows of a burst are then far apart, and an interrupted transfer covers the image evenly.
    """
    height, width = shape
    rows = np.arange(height)
    bits = max(height - 1, 0).bit_length()
    reversed_rows = sum(((rows >> bit) & 1) << (bits - 1 - bit) for bit in range(bits)) + 0 * rows
    return raster(shape).reshape(height, width)[np.argsort(reversed_rows)].reshape(-1)


@lru_cache(maxsize=4)
def tile_after_tile(shape: tuple[int, int]) -> PixelOrder:
    """Return the order of 16 x 16 tiles, row after row, in raster order inside (SPEC 6.4)."""
    rows, columns = (np.arange(size) // 16 for size in shape)
    tiles = rows[:, None] * (columns[-1] + 1) + columns[None, :]
    return np.argsort(tiles.reshape(-1), kind="stable").astype(np.int32)


def _pixels(
    data: ByteArray, arrived: BoolArray, header_bytes: int, order: PixelOrder, pixel_bytes: int
) -> tuple[ByteArray, PixelOrder]:
    """Return the (N, pixel_bytes) completely received pixels of a file, and their raster indices."""
    body = slice(header_bytes, header_bytes + pixel_bytes * order.size)
    parts = arrived[body].reshape(-1, pixel_bytes)
    whole = np.logical_and.reduce([parts[:, part] for part in range(pixel_bytes)])  # faster than ``all``
    return data[body].reshape(-1, pixel_bytes)[whole], order[whole]


def _depth_header(shape: tuple[int, int]) -> bytes:
    return f"P5\n{shape[1]} {shape[0]}\n65535\n".encode()


def _color_header(shape: tuple[int, int]) -> bytes:
    return f"P6\n{shape[1]} {shape[0]}\n255\n".encode()
