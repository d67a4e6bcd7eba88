"""Averaging of measured depth over its own surface; no pixel moves by more than ``FARTHEST_SD`` sigmas."""

from __future__ import annotations

import numpy as np

from pipeline.acquisition.planes import FARTHEST_SD, LocalPlanes
from pipeline.kernels.kdtree import compiled
from pipeline.types import DepthMap, FloatArray


def averaged(planes: LocalPlanes) -> DepthMap:
    """Average every depth over the surrounding pixels of the same surface.

    This is the sigma filter (Lee 1983) along the local plane, in 1/z: a neighbour counts if its distance from
    the pixel's plane is within ``FARTHEST_SD`` standard deviations, so that edges stay and no pixel moves
    farther. Where noise
    is as large as the point spacing, the ball of ball pivoting would get caught inside a wall; averaging
    makes the wall thin again before points are merged.

    Returns:
        (H, W) metric depth, known where it was known before.
    """
    known = planes.known
    noise = FARTHEST_SD * planes.sd
    inverse = _along(planes.inverse, planes.right, noise, planes.reach_px, 0, 1)
    inverse = _along(inverse, planes.down, noise, planes.reach_px, 1, 0)
    inverse = np.clip(inverse, planes.inverse - noise, planes.inverse + noise)
    z_m = np.where(known, 1.0 / np.where(known, inverse, 1.0), np.nan)
    return DepthMap(z_m.astype(np.float32))


@compiled
def _along(
    inverse: FloatArray, slope: FloatArray, farthest: FloatArray, reach_px: int, down: int, right: int
) -> FloatArray:
    """Average (H, W) 1/z over the pixels within reach along one image axis.

    Args:
        inverse: (H, W) float32 1/z, 0 where unknown.
        slope: (H, W) change of 1/z from a pixel to the next one along the axis.
        farthest: (H, W) largest distance of neighbours from a pixel's plane.
        reach_px: number of pixels on either side.
        down: 1 for the vertical axis, with ``right`` 0.
        right: 1 for the horizontal axis, with ``down`` 0.
    """
    rows, columns = inverse.shape
    averaged = np.empty_like(inverse)
    for row in range(rows):
        for column in range(columns):
            here, total, count = inverse[row, column], np.float32(0.0), 0
            for apart_px in range(-reach_px, reach_px + 1):
                v, u = row + down * apart_px, column + right * apart_px
                if 0 <= v < rows and 0 <= u < columns and inverse[v, u] > 0.0:
                    off = inverse[v, u] - here - np.float32(apart_px) * slope[row, column]
                    if abs(off) <= farthest[row, column]:
                        total += off
                        count += 1
            averaged[row, column] = here + total / np.float32(max(count, 1))
    return averaged
