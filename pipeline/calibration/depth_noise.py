"""Noise of a depth sensor as a function of distance and angle, from residuals of a fit (SPEC 1.5)."""

from __future__ import annotations

import math
from dataclasses import astuple, dataclass, fields

import numpy as np

from pipeline.calibration.depth_samples import DepthSamples
from pipeline.types import DepthNoise, FloatArray

PARTS, FEWEST = 4, 60
"""Most parts of a view, by distance, each of which is one noise point, and least pixels per part; a view with
fewer pixels is one part."""
BENDS = 24
"""Number of distances that are tried for the bend of the law."""
STEEPEST = 4.0
"""Largest exponent of the distance: with few distances, a steeper law would fit noise."""
CLIP_SDS = 4.0
RESAMPLES = 100
LEAST_M = 1e-5


@dataclass(frozen=True, slots=True)
class NoisePoints:
    """Measured noise on K patches of boards."""

    z_m: FloatArray
    """(K,) mean true depth."""
    cosine: FloatArray
    """(K,) mean cosine of incidence."""
    sd_m: FloatArray
    """(K,) standard deviation of the depth about the board's fitted plane."""
    view: FloatArray
    """(K,) index of the view."""


def noise_points(samples: DepthSamples, residuals_m: FloatArray) -> NoisePoints:
    """Compute the noise of each view's parts, from nearest to farthest.

    A plane is subtracted from each view's residuals, because an error of the board's pose is not noise.

    Args:
        samples: the pixels on the board.
        residuals_m: (N,) true minus corrected depth.
    """
    rows = []
    for view in np.unique(samples.view):
        mine = np.flatnonzero(samples.view == view)
        u, v = samples.pixels[mine].T
        plane = np.column_stack([np.ones(len(mine)), u / samples.size_px[0], v / samples.size_px[1]])
        flat_m = residuals_m[mine] - plane @ np.linalg.lstsq(plane, residuals_m[mine], rcond=None)[0]
        parts = max(1, min(PARTS, len(mine) // FEWEST))
        for part in np.array_split(np.argsort(samples.true_m[mine], kind="stable"), parts):
            seen = mine[part]
            rows.append(
                (samples.true_m[seen].mean(), samples.cosine[seen].mean(), _clipped_sd_m(flat_m[part]), view)
            )
    return NoisePoints(*np.array(rows).T)


def _clipped_sd_m(values_m: FloatArray) -> float:
    """Return the standard deviation after clipping at four standard deviations; at least ``LEAST_M``."""
    kept = values_m
    for _ in range(5):
        kept = kept[np.abs(kept - kept.mean()) <= CLIP_SDS * max(kept.std(), LEAST_M)]
    return max(float(kept.std()), LEAST_M)


def noise_law(points: NoisePoints) -> DepthNoise:
    """Fit max(s0, s1 z^p) / cos(angle)^q by least squares on its logarithm: near and far count equally.

    The law bends where s1 z^p reaches s0. For a given bend the fit is linear; the bend with the smallest sum
    of squared residuals is chosen. Bends with p above ``STEEPEST`` are left out; at the nearest bend p is
    cut to ``STEEPEST``.
    """
    log_z, log_cos, log_sd = np.log(points.z_m), np.log(points.cosine), np.log(points.sd_m)
    best, least = DepthNoise(LEAST_M, LEAST_M, 0.0, 0.0), np.inf
    for bend in np.linspace(log_z.min(), log_z.max(), BENDS, endpoint=False):
        columns = np.column_stack([np.ones(len(log_z)), np.maximum(log_z - bend, 0.0), -log_cos])
        (log_s0, p, q), squares = _not_negative(columns, log_sd)
        if p > STEEPEST and math.isinf(least):
            p, steep = STEEPEST, log_sd - STEEPEST * columns[:, 1]
            (log_s0, q), squares = _not_negative(columns[:, [0, 2]], steep)
        if squares < least and p <= STEEPEST:
            best, least = DepthNoise(math.exp(log_s0), math.exp(log_s0 - p * bend), p, q), squares
    return best


def _not_negative(columns: FloatArray, values: FloatArray) -> tuple[list[float], float]:
    """Fit (K, P) columns with all parameters but the first >= 0; returns the (P,) parameters and the sum
    of squared residuals.
    """
    used = list(range(columns.shape[1]))
    while True:
        found = np.linalg.lstsq(columns[:, used], values, rcond=None)[0]
        if found[1:].min(initial=0.0) >= 0.0:
            x = np.zeros(columns.shape[1])
            x[used] = found
            return x.tolist(), float(((values - columns @ x) ** 2).sum())
        del used[1 + int(np.argmin(found[1:]))]


def noise_ci95(points: NoisePoints) -> dict[str, FloatArray]:
    """Return (2,) 95 % intervals of the law's parameters by name, from bootstrapping the views."""
    of_views = [np.flatnonzero(points.view == one) for one in np.unique(points.view)]
    rng = np.random.default_rng(0)
    drawn = []
    for _ in range(RESAMPLES):
        rows = np.concatenate([of_views[one] for one in rng.integers(0, len(of_views), len(of_views))])
        some = NoisePoints(points.z_m[rows], points.cosine[rows], points.sd_m[rows], points.view[rows])
        drawn.append(astuple(noise_law(some)))
    low, high = np.percentile(drawn, (2.5, 97.5), axis=0)
    return {one.name: np.array([low[k], high[k]]) for k, one in enumerate(fields(DepthNoise))}
