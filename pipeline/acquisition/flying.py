"""Flying pixels: depth that a sensor reports between a surface and the one behind it.

At the edge of a thing a sensor may mix what it sees of front and back into a depth at which there is
nothing. These are a depth image's real outliers. Slanted walls, far floors and the steps in which
disparity comes are none, though their points lie just as far from each other.
"""

from __future__ import annotations

import cv2
import numpy as np

from pipeline.acquisition.planes import FARTHEST_SD, LocalPlanes
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
    pixels = np.nonzero(beside_a_step(planes))
    pad = planes.reach_px
    padded = LocalPlanes(*(np.pad(x, pad) for x in (planes.inverse, planes.right, planes.down, planes.sd)))
    sides = [
        [distance_sd(padded, pixels, way, pad) for way in ((-down, -right), (down, right))]
        for down, right in LINES
    ]
    score[pixels] = judged(np.array(sides))
    return score


def beside_a_step(planes: LocalPlanes) -> BoolArray:
    """(H, W) pixels beside one that is farther off than noise goes, or unknown: only they can fly."""
    inverse, window = planes.inverse, np.ones((3, 3), np.uint8)
    apart = np.maximum(cv2.dilate(inverse, window) - inverse, inverse - cv2.erode(inverse, window))
    return planes.known & (apart > FARTHEST_SD * planes.sd)


def distance_sd(
    padded: LocalPlanes, pixels: tuple[IntArray, ...], way: tuple[int, int], reach_px: int
) -> FloatArray:
    """(N,) how far pixels are in front of the plane of the next known pixel, in standard deviations.

    Args:
        padded: planes with ``reach_px`` of unknown pixels all around.
        pixels: (N,) rows and (N,) columns, without them.
        way: pixels down and to the right of one step.
        reach_px: steps to go at most; NaN where all of them meet unknown pixels.
    """
    rows, columns = (at + reach_px for at in pixels)
    found = np.full(len(rows), np.nan, np.float32)
    left = np.arange(len(rows))
    for steps in range(1, reach_px + 1):
        there = rows[left] + steps * way[0], columns[left] + steps * way[1]
        hit = padded.inverse[there] > 0
        there = there[0][hit], there[1][hit]
        here = rows[left[hit]], columns[left[hit]]
        slope = way[0] * padded.down[there] + way[1] * padded.right[there]
        off = padded.inverse[here] - (padded.inverse[there] - steps * slope)
        found[left[hit]] = off / np.maximum(np.hypot(padded.sd[here], padded.sd[there]), np.float32(1e-9))
        left = left[~hit]
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
