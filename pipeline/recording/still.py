"""Averaging of the depth images of a camera that stands, pixel by pixel, with a robust vote (SPEC 10.4).

All values are in 1/z, in which a disparity sensor's steps are equal.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import cv2
import numpy as np

from pipeline.kernels.kdtree import compiled
from pipeline.kernels.threads import threads
from pipeline.types import BoolArray, ByteArray, DepthMap, DepthNoise, FloatArray

WITHIN_SD = 3.0
"""Standard deviations of the noise from the median within which measurements count, and the spread, in the
same unit, above which a pixel moves."""
WITHIN_STEPS = 1.5
"""As ``WITHIN_SD``, in steps: noise below one step still moves a pixel to the next one."""
MAD_TO_SIGMA = 1.4826
FLICKERS_BELOW = 0.25
"""Share of the frames below which a pixel that was measured flickers."""
LEAST_VOTES = 3
"""Least number of measurements of which the spread is computed; with fewer, the noise law's is taken."""
MOST_RAISED = 5.0
"""Largest noise and step that are taken for the sensor's own, in standard deviations of the law."""
SAMPLED = 100_000
"""Measurements, about, from which steps and noise are estimated."""
BINS = 12
"""Bins of depth, with equally many measurements, in which the step is estimated."""
BANDS = 8
"""Bands of rows that two threads share: several each, because rows without measurements take no time."""
ENTRIES = 1024
"""Entries of the tables of noise and step over 1/z."""


@dataclass(frozen=True, slots=True)
class Vote:
    """Depth of a camera that stands, from N depth images."""

    depth: DepthMap
    """(H, W) mean of what agrees with the median; NaN where unknown, moving, or flickering too much."""
    sd_m: FloatArray
    """(H, W) float32 standard deviation of this depth; NaN where it is unknown."""
    counts: ByteArray
    """(H, W) number of measurements that were averaged."""
    moving: BoolArray
    """(H, W) True where three or more measurements spread beyond the limit, and next to such regions."""
    flickering: BoolArray
    """(H, W) True for pixels that less than ``FLICKERS_BELOW`` of the frames measured."""


def voted(inverse: FloatArray, noise: DepthNoise) -> Vote:
    """Average depth images pixel by pixel: the mean of what lies within the noise of the median.

    The variance of a mean of n is sd^2/n + step^2/12, with sd of its own measurements (of the law for n < 3)
    and the sensor's step of 1/z, which repeats in all frames. Flickering pixels are kept from three
    measurements on, if all of them agree. If the sensor is noisier than its law, the law is raised to what
    half of the pixels show.

    Args:
        inverse: (N, H, W) float32 1/z, 1/m, 0 where unknown, of at most 255 images.
        noise: law of the sensor's noise.
    """
    range_x, law, step = _tables(inverse, noise)
    limit = np.maximum(WITHIN_SD * law, WITHIN_STEPS * step)
    tables = range_x, limit, law**2, step**2 / 12.0
    edges = np.linspace(0, inverse.shape[1], BANDS + 1).astype(int).tolist()
    bands = [threads("vote", 2).submit(_vote, inverse, first, end, *tables) for first, end in pairwise(edges)]
    mean, variance, counts, measured, spread = map(
        np.concatenate, zip(*(band.result() for band in bands), strict=True)
    )
    moving = _with_neighbours(spread) & (measured > 0)
    flickering = (measured > 0) & (measured < FLICKERS_BELOW * len(inverse))
    dropped = flickering & ((measured < LEAST_VOTES) | (counts < measured))
    known = (counts > 0) & ~moving & ~dropped
    z_m = np.where(known, 1.0 / np.where(known, mean, 1.0), np.nan).astype(np.float32)
    sd_m = (np.sqrt(variance) * z_m**2).astype(np.float32)
    return Vote(DepthMap(z_m), sd_m, np.where(known, counts, 0), moving, flickering)


def _with_neighbours(spread: BoolArray) -> BoolArray:
    """Return (H, W) pixels that spread, and all next to those in whose 3 x 3 pixels most do.

    What moves is a region; a line of pixels at a resting edge jumps between two surfaces alone.
    """
    most = cv2.blur(spread.astype(np.float32), (3, 3), borderType=cv2.BORDER_REPLICATE) > 0.5
    region = cv2.dilate((most & spread).astype(np.uint8), np.ones((3, 3), np.uint8))
    return spread | (region > 0)


def _tables(inverse: FloatArray, noise: DepthNoise) -> tuple[tuple[float, float], FloatArray, FloatArray]:
    """Return the range of a sample of 1/z, and (``ENTRIES``,) standard deviation and step of 1/z over it."""
    every = max(1, round(np.sqrt(inverse[0].size * min(len(inverse), 4) / SAMPLED)))
    some = inverse[:, ::every, ::every]
    values = some[:4][some[:4] > 0.0].astype(float)
    if not len(values):
        return (1.0, 2.0), np.ones(ENTRIES), np.zeros(ENTRIES)
    range_x = float(values.min()), float(values.max())
    x = np.linspace(*range_x, ENTRIES)
    law = noise.sd_m(1.0 / x) * x**2
    return range_x, law * _raised(some, x, law), np.minimum(step_at(x, values), MOST_RAISED * law)


def _raised(inverse: FloatArray, x: FloatArray, law: FloatArray) -> float:
    """Return the median ratio of the pixels' spread to the law, 1 to ``MOST_RAISED``."""
    values = np.where(inverse > 0.0, inverse, np.nan)[:, (inverse > 0.0).sum(axis=0) >= LEAST_VOTES]
    if not values.size:
        return 1.0
    median = np.nanmedian(values, axis=0)
    spread = MAD_TO_SIGMA * np.nanmedian(np.abs(values - median), axis=0)
    return float(np.clip(np.median(spread / np.interp(median, x, law)), 1.0, MOST_RAISED))


def step_at(x: FloatArray, values: FloatArray) -> FloatArray:
    """Return the sensor's step of 1/z at ``x``: the typical distance of its levels there; 0 for a continuum.

    Args:
        x: (K,) 1/z.
        values: (M,) measured 1/z.
    """
    levels, counts = np.unique(values, return_counts=True)
    if len(levels) < 3:
        return np.zeros(len(x))
    apart, weights = 0.5 * (levels[2:] - levels[:-2]), counts[1:-1]
    edges = np.searchsorted(np.cumsum(weights), np.linspace(0.0, weights.sum(), BINS + 1)[1:-1])
    centers, steps = [], []
    for rows in np.split(np.arange(len(apart)), np.unique(edges)):
        if len(rows):
            order = rows[np.argsort(apart[rows])]
            total = np.cumsum(weights[order])
            steps.append(apart[order][np.searchsorted(total, 0.5 * total[-1])])
            centers.append(np.average(levels[1:-1][rows], weights=weights[rows]))
    found: FloatArray = np.interp(x, centers, steps)
    return found


@compiled
def _vote(
    inverse: FloatArray,
    first: int,
    end: int,
    range_x: tuple[float, float],
    limit: FloatArray,
    law_variance: FloatArray,
    step_variance: FloatArray,
) -> tuple[FloatArray, FloatArray, ByteArray, ByteArray, BoolArray]:
    """Return (R, W) mean of 1/z, its variance, measurements averaged and taken, and whether they spread.

    Args:
        inverse: (N, H, W) float32 1/z, 0 where unknown.
        first: first of the R rows.
        end: row after the last one.
        range_x: 1/z of the tables' first and last entry.
        limit: (K,) largest distance from the median of what is averaged.
        law_variance: (K,) variance of one measurement.
        step_variance: (K,) variance that averaging leaves.
    """
    frames, rows, columns = inverse.shape[0], end - first, inverse.shape[2]
    mean, variance = np.zeros((rows, columns)), np.zeros((rows, columns))
    counts, measured = np.zeros((rows, columns), np.uint8), np.zeros((rows, columns), np.uint8)
    spread = np.zeros((rows, columns), np.bool_)
    of_row = np.empty((columns, frames), np.float32)
    per_entry = (len(limit) - 1) / max(range_x[1] - range_x[0], 1e-12)
    for row in range(rows):
        _sort_row(inverse, first + row, of_row, measured[row])
        for column in range(columns):
            own, n = of_row[column], int(measured[row, column])
            if n == 0:
                continue
            median = 0.5 * (np.float64(own[(n - 1) // 2]) + np.float64(own[n // 2]))
            entry = int(min(max((median - range_x[0]) * per_entry + 0.5, 0.0), len(limit) - 1.0))
            count, off, squares, deviation = _near(own, n, median, limit[entry])
            one = law_variance[entry] if count < LEAST_VOTES else squares / (count - 1)
            mean[row, column] = median + off
            variance[row, column] = one / max(count, 1) + step_variance[entry]
            counts[row, column] = count
            spread[row, column] = n >= LEAST_VOTES and MAD_TO_SIGMA * deviation > limit[entry]
    return mean, variance, counts, measured, spread


@compiled
def _sort_row(inverse: FloatArray, row: int, of_row: FloatArray, measured: ByteArray) -> None:
    """Sort the measurements of a row's pixels into (W, N) ``of_row``; count them in (W,) ``measured``."""
    for frame in range(inverse.shape[0]):
        for column in range(inverse.shape[2]):
            value = inverse[frame, row, column]
            if value > 0.0:
                place = int(measured[column])
                while place > 0 and of_row[column, place - 1] > value:
                    of_row[column, place] = of_row[column, place - 1]
                    place -= 1
                of_row[column, place] = value
                measured[column] += 1


@compiled
def _near(own: FloatArray, n: int, median: float, limit: float) -> tuple[int, float, float, float]:
    """Average those of n ascending values that lie within ``limit`` of their median.

    Returns:
        Their number, the distance of their mean from the median, the sum of their squared distances from the
        mean, and the median distance of all values from the median (infinite if it is above the limit).
    """
    below, above = n // 2 - 1, n // 2
    count, total, squares, deviation = 0, 0.0, 0.0, np.inf
    while below >= 0 or above < n:
        down = median - own[below] if below >= 0 else np.inf
        up = own[above] - median if above < n else np.inf
        off = min(down, up)
        if off > limit:
            break
        if down < up:
            below, off = below - 1, -off
        else:
            above += 1
        total += off
        squares += off * off
        count += 1
        if count == (n + 1) // 2:
            deviation = abs(off)
    mean = total / max(count, 1)
    return count, mean, max(squares - total * mean, 0.0), deviation
