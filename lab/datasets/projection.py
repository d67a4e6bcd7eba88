"""Projection of points to a depth image that keeps the nearest point of each pixel."""

from __future__ import annotations

import numpy as np

from pipeline.types import FloatArray, IntArray


def nearest_per_pixel(pixels: IntArray, z_m: FloatArray, shape: tuple[int, int]) -> FloatArray:
    """Return (H, W) float32 depth of the nearest point on each pixel, NaN without a point.

    Args:
        pixels: (N, 2) column and row; may be outside the image.
        z_m: (N,) depths, metres.
        shape: height and width, pixels.
    """
    height, width = shape
    u, v = pixels[:, 0], pixels[:, 1]
    inside = (u >= 0) & (u < width) & (v >= 0) & (v < height)
    depth_m = np.full(shape, np.inf, dtype=np.float32)
    np.minimum.at(depth_m, (v[inside], u[inside]), z_m[inside].astype(np.float32))
    depth_m[np.isinf(depth_m)] = np.nan
    return depth_m
