"""Detection of flying pixels: depths that a sensor reports between a surface and the one behind it.

At the edge of an object a sensor may mix the depths of front and back to a depth without any surface. These
pixels are the real outliers of a depth image. Points of slanted walls, far floors and steps of quantised
disparity are no outliers, although they are equally far apart.
"""

from __future__ import annotations

import cv2
import numpy as np

from pipeline.acquisition.planes import FARTHEST_SD, LocalPlanes
from pipeline.kernels.kdtree import compiled
from pipeline.types import BoolArray, FloatArray, IntArray

LEAST_SIDES = 3
"""Least number of surrounding surfaces that must all be far from an isolated pixel: with two, it may be
the end of a wire."""
LINES = ((0, 1), (1, 0), (1, 1), (1, -1))
"""Pixel steps down and to the right along the four lines through a pixel."""


def flying_score(planes: LocalPlanes) -> FloatArray:
    """Return every pixel's distance from all surfaces to which it could belong, in standard deviations.

    On each of four lines through a pixel, the plane of the next measured pixel on either side is extended
    to it. For a pixel between a plane in front of it and one behind it, the score is the smaller of both
    distances, on the line where this is largest. For an isolated pixel, far from planes on three or more
    sides, it is the distance of the nearest plane.

    Returns:
        (H, W) float32; 0 for pixels that cannot be judged. Pixels above ``FARTHEST_SD`` are flying.
    """
    score = np.zeros(planes.inverse.shape, np.float32)
    rows, columns = map(np.ascontiguousarray, np.nonzero(next_to_a_step(planes)))
    parts = planes.inverse, planes.right, planes.down, planes.sd
    score[rows, columns] = judged(_distances_sd(*parts, rows, columns, planes.reach_px))
    return score


def next_to_a_step(planes: LocalPlanes) -> BoolArray:
    """Return (H, W) True next to unknown pixels or depth steps above the noise: only these pixels can fly."""
    inverse, window = planes.inverse, np.ones((3, 3), np.uint8)
    apart = np.maximum(cv2.dilate(inverse, window) - inverse, inverse - cv2.erode(inverse, window))
    return planes.known & (apart > FARTHEST_SD * planes.sd)


@compiled
def _distances_sd(
    inverse: FloatArray,
    right: FloatArray,
    down: FloatArray,
    sd: FloatArray,
    rows: IntArray,
    columns: IntArray,
    reach_px: int,
) -> FloatArray:
    """Return (lines, 2, N) distances from the planes on either side, standard deviations, positive in front.

    Args:
        inverse, right, down, sd: (H, W) float32, as in ``LocalPlanes``.
        rows: (N,) rows of the pixels.
        columns: (N,) columns of the pixels.
        reach_px: most steps on a side; the distance is NaN if all of them meet unknown pixels.
    """
    found = np.full((len(LINES), 2, len(rows)), np.nan, np.float32)
    for line, (dv, du) in enumerate(LINES):
        for side in range(2):
            way = 2 * side - 1
            for i in range(len(rows)):
                for steps in range(1, reach_px + 1):
                    v, u = rows[i] + way * steps * dv, columns[i] + way * steps * du
                    if not (0 <= v < inverse.shape[0] and 0 <= u < inverse.shape[1]):
                        break
                    if inverse[v, u] > 0.0:
                        slope = np.float32(way * dv) * down[v, u] + np.float32(way * du) * right[v, u]
                        plane = inverse[v, u] - np.float32(steps) * slope
                        noise = np.hypot(sd[rows[i], columns[i]], sd[v, u])
                        off = inverse[rows[i], columns[i]] - plane
                        found[line, side, i] = off / max(noise, np.float32(1e-9))
                        break
    return found


def judged(sides: FloatArray) -> FloatArray:
    """Return (N,) scores from (lines, 2, N) signed distances on both sides, NaN where there is no surface."""
    known = np.isfinite(sides)
    off = np.abs(np.where(known, sides, 0.0))
    apart = np.prod(np.where(known, sides, 0.0), axis=1) < 0
    between = np.where(apart, off.min(axis=1), 0.0).max(axis=0)
    nearest = np.where(known, off, np.inf).min(axis=(0, 1))
    alone = np.where(known.sum(axis=(0, 1)) >= LEAST_SIDES, nearest, 0.0)
    return np.maximum(between, alone)
