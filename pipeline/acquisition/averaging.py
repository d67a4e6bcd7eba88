"""Measured depth averaged over its own surface: less noise, no steps, no pixel moved beyond its noise."""

from __future__ import annotations

import numpy as np

from pipeline.acquisition.planes import FARTHEST_SD, LocalPlanes
from pipeline.kernels.kdtree import compiled
from pipeline.types import DepthMap, FloatArray


def averaged(planes: LocalPlanes) -> DepthMap:
    """Every depth as the mean of what the pixels around it say of it, of its own surface only.

    The sigma filter (Lee 1983) along the local plane, in 1/z: a neighbour counts if it is no farther off
    the pixel's plane than noise goes, so that edges stay and no pixel moves beyond its noise. Where noise is
    as thick as points are apart, a ball that should roll along a wall gets caught inside it; averaged over
    the image the wall is thin again before any point is merged with another.

    Returns:
        (H, W) metric, known where it was.
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
    """(H, W) 1/z averaged over the pixels within reach along one axis of the image.

    Args:
        inverse: (H, W) float32 1/z, 0 where unknown.
        slope: (H, W) its change from a pixel to the next one along the axis.
        farthest: (H, W) how far off a pixel's plane its neighbours may be.
        reach_px: how far to go on either side.
        down: 1 to go down, with ``right`` 0.
        right: 1 to go to the right, with ``down`` 0.
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
