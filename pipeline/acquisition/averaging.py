"""Measured depth averaged over its own surface: less noise, no steps, no pixel moved beyond its noise."""

from __future__ import annotations

import numpy as np

from pipeline.acquisition.planes import FARTHEST_SD, LocalPlanes
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
    inverse = along(along(planes.inverse, planes.right, planes, 1), planes.down, planes, 0)
    noise = FARTHEST_SD * planes.sd
    inverse = np.clip(inverse, planes.inverse - noise, planes.inverse + noise)
    z_m = np.where(known, 1.0 / np.where(known, inverse, 1.0), np.nan)
    return DepthMap(z_m.astype(np.float32))


def along(inverse: FloatArray, slope: FloatArray, planes: LocalPlanes, axis: int) -> FloatArray:
    """(H, W) 1/z averaged over the pixels within reach along one axis of the image."""
    reach_px, farthest = planes.reach_px, FARTHEST_SD * planes.sd
    margin = [(0, 0), (0, 0)]
    margin[axis] = (reach_px, reach_px)
    padded = np.pad(inverse, margin)
    total, count = np.zeros_like(inverse), np.zeros_like(inverse)
    for apart_px in range(-reach_px, reach_px + 1):
        start = reach_px + apart_px
        other = padded[:, start:][:, : inverse.shape[1]] if axis else padded[start:][: inverse.shape[0]]
        off = other - inverse - np.float32(apart_px) * slope
        counts = (other > 0) & (np.abs(off) <= farthest)
        total += np.where(counts, off, np.float32(0.0))
        count += counts
    return inverse + total / np.maximum(count, 1.0)
