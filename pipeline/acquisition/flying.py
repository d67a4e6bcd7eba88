"""Flying pixels: depth that a sensor reports between a surface and the one behind it.

At the edge of a thing a sensor may mix what it sees of front and back into a depth at which there is
nothing. These are a depth image's real outliers. Slanted walls, far floors and the steps in which
disparity comes are none, though their points lie just as far from each other.
"""

from __future__ import annotations

import cv2
import numpy as np

from pipeline.acquisition.planes import FARTHEST_SD, LocalPlanes
from pipeline.kernels.kdtree import compiled
from pipeline.types import BoolArray, FloatArray, IntArray

LEAST_SIDES = 3
"""Surfaces around a pixel that must all be far from it to prove that it stands alone: with two, it may be
the end of a wire."""
LINES = ((0, 1), (1, 0), (1, 1), (1, -1))
"""Pixels down and to the right along the four lines through a pixel."""


def flying_score(planes: LocalPlanes) -> FloatArray:
    """How far every pixel is from all surfaces that it could be of, in standard deviations.

    On each of four lines through a pixel the local plane of the next measured pixel on either side is
    continued to it. A pixel with one plane in front of it and the other behind it flies by the lesser of
    the two distances, on the line where that is most. One that stands alone, with planes on three sides or
    more and all of them far, flies by the distance of the nearest.

    Returns:
        (H, W) float32; 0 where nothing says that a pixel flies. Those above ``FARTHEST_SD`` do.
    """
    score = np.zeros(planes.inverse.shape, np.float32)
    rows, columns = map(np.ascontiguousarray, np.nonzero(beside_a_step(planes)))
    parts = planes.inverse, planes.right, planes.down, planes.sd
    score[rows, columns] = judged(_distances_sd(*parts, rows, columns, planes.reach_px))
    return score


def beside_a_step(planes: LocalPlanes) -> BoolArray:
    """(H, W) pixels beside one that is farther off than noise goes, or unknown: only they can fly."""
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
    """(lines, 2, N) how far pixels are in front of the planes on either side, in standard deviations.

    Args:
        inverse, right, down, sd: (H, W) float32, as in ``LocalPlanes``.
        rows: (N,) of the pixels.
        columns: (N,) of the pixels.
        reach_px: steps to go at most; NaN where all of them meet unknown pixels.
    """
    found = np.full((len(LINES), 2, len(rows)), np.nan, np.float32)
    for line, (below, beside) in enumerate(LINES):
        for side in range(2):
            way = 2 * side - 1
            for i in range(len(rows)):
                for steps in range(1, reach_px + 1):
                    v, u = rows[i] + way * steps * below, columns[i] + way * steps * beside
                    if not (0 <= v < inverse.shape[0] and 0 <= u < inverse.shape[1]):
                        break
                    if inverse[v, u] > 0.0:
                        slope = np.float32(way * below) * down[v, u] + np.float32(way * beside) * right[v, u]
                        plane = inverse[v, u] - np.float32(steps) * slope
                        noise = np.hypot(sd[rows[i], columns[i]], sd[v, u])
                        off = inverse[rows[i], columns[i]] - plane
                        found[line, side, i] = off / max(noise, np.float32(1e-9))
                        break
    return found


def judged(sides: FloatArray) -> FloatArray:
    """(N,) scores from (lines, 2, N) signed distances on both sides; NaN where there is no surface."""
    known = np.isfinite(sides)
    off = np.abs(np.where(known, sides, 0.0))
    apart = np.prod(np.where(known, sides, 0.0), axis=1) < 0
    between = np.where(apart, off.min(axis=1), 0.0).max(axis=0)
    nearest = np.where(known, off, np.inf).min(axis=(0, 1))
    alone = np.where(known.sum(axis=(0, 1)) >= LEAST_SIDES, nearest, 0.0)
    return np.maximum(between, alone)
