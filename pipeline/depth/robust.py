"""Robust fit of a straight line to points with many outliers (SPEC 3.5, items 2 and 3)."""

from __future__ import annotations

import numpy as np

from pipeline.kernels.kdtree import compiled
from pipeline.types import FloatArray, IntArray

MAX_SAMPLES = 40_000
MAX_ITERATIONS = 30
TUKEY_WIDTH = 4.685 * 1.4826
DRAWS = 200
INLIER_BAND = 0.05
SEARCHED_OUTLIER_SHARE = 0.4


def fit_line(x: FloatArray, y: FloatArray, rng: np.random.Generator) -> tuple[float, float]:
    """Fit slope and intercept of y = a x + b with Tukey's biweight, iteratively reweighted.

    The start is least squares, or the best of 200 random pairs of points if more than 40 % of the points
    are farther than 5 % of y from the least-squares line. Of more than 40,000 points every k-th is used.

    Args:
        x: (N,) abscissas.
        y: (N,) ordinates, positive.
        rng: random generator of the pairs.
    """
    stride = -(-len(x) // MAX_SAMPLES)
    x, y = x[::stride], y[::stride]
    a, b = weighted_line(x, y, np.ones_like(x))
    if np.mean(np.abs(y - a * x - b) > INLIER_BAND * y) > SEARCHED_OUTLIER_SHARE:
        a, b = best_random_line(x, y, rng)
    least_width = 1e-9 * float(np.median(y))
    for _ in range(MAX_ITERATIONS):
        residual = y - a * x - b
        spread = np.median(np.abs(residual - np.median(residual)))
        width = max(TUKEY_WIDTH * spread, least_width)
        weights = np.clip(1.0 - (residual / width) ** 2, 0.0, None) ** 2
        before = a, b
        a, b = weighted_line(x, y, weights)
        if np.allclose((a, b), before, rtol=1e-9, atol=1e-12):
            break
    return a, b


def weighted_line(x: FloatArray, y: FloatArray, weights: FloatArray) -> tuple[float, float]:
    """Fit slope and intercept by weighted least squares; the line is horizontal if all x are equal."""
    total = float(weights.sum())
    if not total > 0.0:
        return 0.0, float(np.median(y))

    def mean(values: FloatArray) -> float:  # a product of vectors would wait for the threads of BLAS
        return float(np.sum(weights * values)) / total

    mean_x, mean_y = mean(x), mean(y)
    variance = mean((x - mean_x) ** 2)
    if variance <= 1e-12 * mean_x**2:
        return 0.0, mean_y
    a = mean((x - mean_x) * (y - mean_y)) / variance
    return a, mean_y - a * mean_x


def best_random_line(x: FloatArray, y: FloatArray, rng: np.random.Generator) -> tuple[float, float]:
    """Return slope and intercept of the rising line with the most points within 5 % of y, of 200 lines
    through two random points; a line that does not rise if none does.
    """
    first, second = rng.integers(len(x), size=(2, DRAWS))
    run = x[second] - x[first]
    slopes = np.where(run != 0.0, (y[second] - y[first]) / np.where(run != 0.0, run, 1.0), -1.0)
    intercepts = y[first] - slopes * x[first]
    stride = -(-len(x) // 5000)
    xs, ys = (np.ascontiguousarray(of[::stride]) for of in (x, y))
    best = int(np.argmax(np.where(slopes > 0.0, _points_near(slopes, intercepts, xs, ys), -1)))
    return float(slopes[best]), float(intercepts[best])


@compiled
def _points_near(slopes: FloatArray, intercepts: FloatArray, x: FloatArray, y: FloatArray) -> IntArray:
    """Count, for each of (L,) lines, the (N,) points within ``INLIER_BAND`` times y of it."""
    counts = np.zeros(len(slopes), np.int64)
    for line in range(len(slopes)):
        for i in range(len(x)):
            counts[line] += abs(slopes[line] * x[i] + intercepts[line] - y[i]) < INLIER_BAND * y[i]
    return counts
