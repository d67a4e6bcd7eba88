"""Rays through pixels, and random numbers that are stratified over neighbouring pixels."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np

from lab.worlds import shading
from pipeline.kernels.geometry import pixel_rays
from pipeline.types import CameraIntrinsics, FloatArray, IntArray


def camera_rays(
    intrinsics: CameraIntrinsics, T_world_camera: FloatArray, offset_px: tuple[float, float] = (0.0, 0.0)
) -> FloatArray:
    """Return (H * W, 6) float32 world rays whose parameter t is depth z, ``offset_px`` from pixel centres."""
    matrix = intrinsics.matrix.copy()
    matrix[:2, 2] -= offset_px
    directions = pixel_rays(replace(intrinsics, matrix=matrix)).reshape(-1, 3)
    rays = np.empty((len(directions), 6), np.float32)
    shading.rotate(directions, T_world_camera.astype(np.float64), rays)
    return rays


def dither(shape: tuple[int, int], rng: np.random.Generator) -> FloatArray:
    """Return (H * W, 2) random numbers, 0 to 1, stratified over each tile of 4 x 4 pixels."""
    shifted = rng.random((shape[0] * shape[1], 2), dtype=np.float32)
    shifted *= np.float32(1.0 / 16.0)
    shifted += _strata(shape)
    return shifted


@lru_cache(maxsize=4)
def lit_pixels(shape: tuple[int, int], every: bool) -> IntArray:
    """Return the indices, row by row, of the pixels whose light is traced: all, or half (checkerboard)."""
    y, x = np.mgrid[: shape[0], : shape[1]]
    return np.flatnonzero((x + y) % 2 == 0) if not every else np.arange(x.size)


@lru_cache(maxsize=4)
def _strata(shape: tuple[int, int]) -> FloatArray:
    """Return (H * W, 2) lower ends of the intervals, 1/16 wide, in which the pixels of a 4 x 4 tile draw."""
    first = np.array([[0, 8, 2, 10], [12, 4, 14, 6], [3, 11, 1, 9], [15, 7, 13, 5]])
    second = np.array([[0, 5, 10, 15], [11, 14, 1, 4], [6, 3, 12, 9], [13, 8, 7, 2]])
    repeats = (-(-shape[0] // 4), -(-shape[1] // 4))
    pair = [np.tile(tile, repeats)[: shape[0], : shape[1]] for tile in (first, second)]
    return (np.stack(pair, axis=-1).reshape(-1, 2) / 16.0).astype(np.float32)
