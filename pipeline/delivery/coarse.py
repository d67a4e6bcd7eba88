"""Coarse colour and depth images, small enough for strong protection: the base layer of SPEC 6.5."""

from __future__ import annotations

from functools import lru_cache

import cv2
import numpy as np
from numpy.typing import NDArray

from pipeline.delivery import levels
from pipeline.delivery.coding import DepthArray, areas_of
from pipeline.delivery.pictures import read_av1, write_av1
from pipeline.types import ByteArray

DEPTH_BLOCK = 8
"""Side in pixels of the blocks that share one depth."""
COLOR_BLOCK = 4
COLOR_QUALITY = 60
"""Of AVIF: smaller than JPEG's 75, and more similar to the image."""
_LENGTH_BYTES = 3
SAME_SURFACE = 0.05
"""Neighbouring depths with a larger relative difference are not blended: no surface is between them."""


def write_depth(depth: DepthArray) -> bytes:
    """Encode the medians of depth blocks as one tile of levels, 0 where most of a block has no depth."""
    height, width = depth.shape
    padded = np.pad(depth, ((0, -height % DEPTH_BLOCK), (0, -width % DEPTH_BLOCK)))
    shape = (padded.shape[0] // DEPTH_BLOCK, DEPTH_BLOCK, padded.shape[1] // DEPTH_BLOCK, DEPTH_BLOCK)
    blocks = np.sort(padded.reshape(shape).swapaxes(1, 2).reshape(shape[0], shape[2], -1), axis=2)
    known = np.count_nonzero(blocks, axis=2)
    middle = blocks.shape[2] - known + np.maximum(known - 1, 0) // 2
    middle = np.minimum(middle, blocks.shape[2] - 1)
    medians = np.take_along_axis(blocks, middle[..., None], axis=2)[..., 0]
    inside = np.outer(_inside(height, shape[0]), _inside(width, shape[2]))
    grid = np.where(2 * known >= inside, medians, 0).astype(np.uint16)
    coded = levels.encode(grid, areas_of(grid.shape, max(grid.shape)))
    return len(coded.header).to_bytes(_LENGTH_BYTES, "big") + coded.header + coded.tiles[0]


def write_color(rgb: ByteArray) -> bytes:
    """Encode a reduced colour image as AVIF, without its header."""
    height, width = rgb.shape[:2]
    size = (-(-width // COLOR_BLOCK), -(-height // COLOR_BLOCK))
    return write_av1(cv2.resize(rgb, size, interpolation=cv2.INTER_AREA), COLOR_QUALITY)


@lru_cache(maxsize=16)
def read_depth(stream: bytes, shape: tuple[int, int]) -> DepthArray:
    """Decode (H, W) depth, interpolated between the blocks' centres; 0 where a block has none; read-only."""
    depth = _blended(read_blocks(stream, shape).astype(np.float32), shape)
    depth.setflags(write=False)
    return depth


def read_blocks(stream: bytes, shape: tuple[int, int]) -> DepthArray:
    """Decode one depth a block of an (H, W) image; 0 where a block has none."""
    grid_shape = (-(-shape[0] // DEPTH_BLOCK), -(-shape[1] // DEPTH_BLOCK))
    tile = _LENGTH_BYTES + int.from_bytes(stream[:_LENGTH_BYTES], "big")
    grid = np.zeros(grid_shape, np.uint16)
    if stream[tile:]:
        listed = levels.read_header(stream[_LENGTH_BYTES:tile])
        values = levels.decode_tile(np.frombuffer(stream[tile:], np.uint8), listed, grid_shape)
        grid[:] = values.reshape(grid_shape)
    return grid


@lru_cache(maxsize=16)
def read_color(frame: bytes, shape: tuple[int, int]) -> ByteArray:
    """Decode (H, W, 3) RGB; read-only."""
    small = read_av1(frame, (-(-shape[0] // COLOR_BLOCK), -(-shape[1] // COLOR_BLOCK)), COLOR_QUALITY)
    rgb = cv2.resize(small, (shape[1], shape[0]), interpolation=cv2.INTER_CUBIC)
    rgb.setflags(write=False)
    return rgb


def _inside(size: int, blocks: int) -> NDArray[np.integer]:
    """Return how many pixels of each block are in the image, along one side."""
    return np.minimum(DEPTH_BLOCK, size - DEPTH_BLOCK * np.arange(blocks))


def _blended(grid: NDArray[np.float32], shape: tuple[int, int]) -> DepthArray:
    """Interpolate bilinearly among those of the four nearest blocks that are on the pixel's surface."""
    (top, bottom, down), (left, right, across) = (
        _neighbours(size, blocks) for size, blocks in zip(shape, grid.shape, strict=True)
    )
    own = np.repeat(np.repeat(grid, DEPTH_BLOCK, axis=0), DEPTH_BLOCK, axis=1)[: shape[0], : shape[1]]
    total, weights = np.zeros(shape, np.float32), np.zeros(shape, np.float32)
    for rows, row_weight in ((top, 1 - down), (bottom, down)):
        for columns, column_weight in ((left, 1 - across), (right, across)):
            corner = grid[np.ix_(rows, columns)]
            weight = np.where(
                np.abs(corner - own) <= SAME_SURFACE * own, np.outer(row_weight, column_weight), 0
            )
            total += weight * corner
            weights += weight
    return np.rint(np.divide(total, weights, out=np.zeros_like(total), where=weights > 0)).astype(np.uint16)


def _neighbours(size: int, blocks: int) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.float32]]:
    """Return, for each pixel along one side, the blocks before and after it, and the weight of the latter."""
    position = (np.arange(size) + 0.5) / DEPTH_BLOCK - 0.5
    before = np.floor(position).astype(np.int64)
    share = (position - before).astype(np.float32)
    return np.maximum(before, 0), np.minimum(before + 1, blocks - 1), share
