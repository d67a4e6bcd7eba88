"""Estimation of a depth sensor's bias (offset, scale, curvature, a map over the image) and noise from views
of calibration boards, with as many terms as held-out views justify (SPEC 1.5).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from packetmesh.errors import InputError
from pipeline.calibration.depth_noise import NoisePoints, noise_ci95, noise_law, noise_points
from pipeline.calibration.depth_samples import DepthSamples
from pipeline.calibration.depth_terms import (
    GROUPS,
    Problem,
    chosen_terms,
    columns_of,
    half_width,
    map_directions,
    robust_problem,
    rows_of_views,
    separable,
)
from pipeline.io.depth_correction import MAP_SHAPE, DepthCorrection
from pipeline.types import DepthNoise, FloatArray

LEAST_VIEWS = 4
ROUNDS = 3
"""Number of alternations between estimates of noise and bias."""
WIDTH = sum(len(columns) for columns in GROUPS.values())
"""Number of columns of the design matrix."""


@dataclass(frozen=True, slots=True)
class BiasPoints:
    """Bias in each of V views, on white paper."""

    z_m: FloatArray
    """(V,) mean measured depth."""
    before_m: FloatArray
    """(V,) mean of measured minus true depth."""
    after_m: FloatArray
    """(V,) mean of corrected minus true depth."""


@dataclass(frozen=True, slots=True)
class DepthFit:
    """A depth correction and the evidence for it."""

    correction: DepthCorrection
    terms: tuple[str, ...]
    """Terms that held-out views justify."""
    covariance: FloatArray
    """(p, p) covariance of the parameters of ``terms``: offset, scale and curvature as far as they are used,
    then the map's eleven coefficients along ``depth_terms.map_directions``."""
    held_out_m: Mapping[str, float]
    """RMS depth error in held-out views, by the terms of each model that was tried."""
    rms_before_m: float
    """Error of the measured depth: root of the mean over views of the mean square, with Huber weights."""
    rms_after_m: float
    """The same for the corrected depth."""
    scale_focal_correlation: float | None
    """Correlation of the errors of scale and focal length; None without a scale."""
    points: BiasPoints
    """Data to which the bias terms are fitted."""
    noise_points: NoisePoints
    """Data to which the noise law is fitted."""
    ink_offset_m: tuple[float, float] | None
    """Depth error on black minus that on white, after correction, and its standard error; None if fewer than
    two views have both."""
    note: str
    """Sentence on terms that the views cannot separate, and on views to take; empty if there are none."""

    def bias_m(self, z_m: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return (N,) measured minus true depth, without the map, at (N,) depths, and half of its 95 %
        interval.
        """
        powers = {"offset": np.ones_like(z_m), "scale": z_m, "curvature": z_m**2}
        used = [powers[term] for term in self.terms if term in powers]
        columns = np.array(used).reshape(len(used), len(z_m))
        variance_m2 = np.einsum("in,ij,jn->n", columns, self.covariance[: len(used), : len(used)], columns)
        plain = self.correction
        off_m = plain.offset_m + (plain.scale - 1.0) * z_m + plain.curvature_per_m * z_m**2
        return -off_m, half_width(len(self.points.z_m)) * np.sqrt(variance_m2)

    def metrics(self) -> dict[str, Any]:
        """Return the block ``depth`` of ``packetmesh calibrate --json``."""
        correction = self.correction
        values: dict[str, Any] = {
            "offset_m": correction.offset_m,
            "scale": correction.scale,
            "curvature_per_m": correction.curvature_per_m,
            "map_coefficients": correction.map_coefficients.tolist(),
        }
        return {
            "terms": list(self.terms),
            "values": values,
            "ci95": {name: interval.tolist() for name, interval in correction.ci95.items()},
            "noise_law": None if correction.noise is None else asdict(correction.noise),
            "range_m": list(correction.range_m),
            "rms_before_m": self.rms_before_m,
            "rms_after_m": self.rms_after_m,
            "held_out_rms_m": dict(self.held_out_m),
            "scale_focal_correlation": self.scale_focal_correlation,
            "ink_offset_m": None if self.ink_offset_m is None else list(self.ink_offset_m),
            "note": self.note,
        }


def fit_depth(samples: DepthSamples) -> DepthFit:
    """Estimate a sensor's bias and noise.

    A pixel's weight is 1/sd^2 by the noise law times Huber's at 3 sd; every view has the same weight, because
    the error of the board's pose affects all its pixels alike. A term is kept only if it lowers the error in
    held-out views by more than the standard error and its interval excludes 0. Standard errors combine the
    jackknife over views with the lens's uncertainty.

    Args:
        samples: pixels of at least four views; the fit leaves out those on ink.

    Raises:
        InputError: fewer than four views have pixels on white paper.
    """
    paper = samples.select(~samples.ink)
    count = len(rows_of_views(paper))
    if count < LEAST_VIEWS:
        raise InputError(
            f"{count} views have depth on the board's white paper, and it takes {LEAST_VIEWS} from near to "
            "far to find the bias of depth; take more, in which white areas are at least five pixels wide"
        )
    choice = separable(paper)
    bias_m: FloatArray = np.zeros(len(paper))
    for _ in range(ROUNDS):
        points = noise_points(paper, paper.true_m - paper.measured_m - bias_m)
        noise = noise_law(points)
        sd_m = noise.sd_m(paper.true_m, paper.cosine)
        problem = robust_problem(paper, paper.true_m - bias_m, sd_m, choice)
        bias_m = problem.y_m - problem.residuals_m(columns_of(choice.richest))
    terms, held_out_m = chosen_terms(problem, choice)
    columns = columns_of(terms)
    correction = _correction(paper, problem, terms, noise, noise_ci95(points))
    return DepthFit(
        correction=correction,
        terms=terms,
        covariance=problem.covariance(columns),
        held_out_m=held_out_m,
        rms_before_m=problem.rms_m(problem.y_m),
        rms_after_m=problem.rms_m(problem.residuals_m(columns)),
        scale_focal_correlation=_with_focal(problem, terms, samples.lens_focal),
        points=_points(paper, problem, correction),
        noise_points=points,
        ink_offset_m=_ink_offset_m(samples, correction),
        note=choice.note,
    )


def _points(samples: DepthSamples, problem: Problem, correction: DepthCorrection) -> BiasPoints:
    corrected_m = correction.corrected_m(samples.measured_m, samples.pixels)
    return BiasPoints(
        problem.mean_by_view(samples.measured_m),
        problem.mean_by_view(samples.measured_m - samples.true_m),
        problem.mean_by_view(corrected_m - samples.true_m),
    )


def _with_focal(problem: Problem, terms: tuple[str, ...], lens_focal: FloatArray) -> float | None:
    """Return the correlation of the errors of scale and focal length; None without a scale."""
    if "scale" not in terms:
        return None
    columns = columns_of(terms)
    row = terms.index("scale")
    spread = float(np.sqrt(problem.covariance(columns)[row, row])) * float(np.linalg.norm(lens_focal))
    return float(problem.lens_shifts(columns)[row] @ lens_focal) / spread if spread > 0.0 else 0.0


def _correction(
    samples: DepthSamples,
    problem: Problem,
    terms: tuple[str, ...],
    noise: DepthNoise,
    intervals: Mapping[str, FloatArray],
) -> DepthCorrection:
    """Build the correction from the terms, with 95 % intervals."""
    columns = columns_of(terms)
    values, spread = np.zeros(WIDTH), np.zeros((WIDTH, WIDTH))
    values[columns], spread[np.ix_(columns, columns)] = problem.solve(columns), problem.covariance(columns)
    on_map = list(GROUPS["map"])
    directions = map_directions()
    coefficients = (directions @ values[on_map]).reshape(MAP_SHAPE)
    map_variance = np.einsum("ij,jk,ik->i", directions, spread[np.ix_(on_map, on_map)], directions)
    middle = {
        "offset_m": (values[0], spread[0, 0]),
        "scale": (1.0 + values[1], spread[1, 1]),
        "curvature_per_m": (values[2], spread[2, 2]),
        "map_coefficients": (coefficients, map_variance.reshape(MAP_SHAPE)),
    }
    wide = half_width(len(problem.views))
    ci95 = {
        name: np.stack([value - wide * np.sqrt(variance), value + wide * np.sqrt(variance)], axis=-1)
        for (name, (value, variance)), term in zip(middle.items(), GROUPS, strict=True)
        if term in terms
    }
    return DepthCorrection(
        size_px=samples.size_px,
        offset_m=float(values[0]),
        scale=float(1.0 + values[1]),
        curvature_per_m=float(values[2]),
        map_coefficients=coefficients,
        noise=noise,
        range_m=(float(samples.measured_m.min()), float(samples.measured_m.max())),
        ci95={**ci95, **intervals},
    )


def _ink_offset_m(samples: DepthSamples, correction: DepthCorrection) -> tuple[float, float] | None:
    """Return the mean error on ink minus that on paper, metres, and its standard error; None if fewer than
    two views have both.
    """
    off_m = correction.corrected_m(samples.measured_m, samples.pixels) - samples.true_m
    apart = [
        float(np.median(off_m[rows[ink]]) - np.median(off_m[rows[~ink]]))
        for rows in rows_of_views(samples)
        if (ink := samples.ink[rows]).any() and not ink.all()
    ]
    if len(apart) < 2:
        return None
    return float(np.mean(apart)), float(np.std(apart, ddof=1) / np.sqrt(len(apart)))
