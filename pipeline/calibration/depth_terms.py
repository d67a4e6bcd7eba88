"""Linear least squares for the terms of a depth sensor's bias, each view as one observation (SPEC 1.5)."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import null_space
from scipy.special import stdtrit  # student's t; scipy.stats takes a second to import

from pipeline.calibration.depth_samples import DepthSamples
from pipeline.io.depth_correction import MAP_SHAPE, map_basis, map_means
from pipeline.types import BoolArray, FloatArray, IntArray

GROUPS = {"offset": (0,), "scale": (1,), "curvature": (2,), "map": tuple(range(3, 14))}
"""Columns of the design matrix by the name of the term."""
LADDER: tuple[tuple[str, ...], ...] = (
    (),
    ("offset",),
    ("scale",),
    ("offset", "scale"),
    ("offset", "scale", "curvature"),
)
"""Models in the order of complexity; the map can be added to any of them."""
APART, FAR_APART = 1.3, 2.0
"""Least ratio of farthest to nearest view that separates offset from scale, and both from curvature."""
VIEWS_OF_A_PART = 2
"""Least number of views that must show the board in each of the map's 3 x 4 image parts."""
HUBER_SDS, HUBER_ROUNDS = 3.0, 8


def title_of(terms: Iterable[str]) -> str:
    """Return the title of a model: its terms, or "none"."""
    return " + ".join(terms) or "none"


def columns_of(terms: Iterable[str]) -> IntArray:
    """Return the (p,) indices of the terms' columns in the design matrix."""
    return np.array([column for term in terms for column in GROUPS[term]], np.int64)


def map_directions() -> FloatArray:
    """Return (12, 11) orthonormal changes of the map's coefficients that keep its mean at 0."""
    return null_space(map_means().reshape(1, -1))


def design(samples: DepthSamples, z_m: FloatArray) -> FloatArray:
    """Return (N, 14) derivatives 1, z, z^2, z s of the true depth by the terms, at depths z; s are the 11 map
    functions.
    """
    rows, columns = map_basis(samples.size_px, samples.pixels)
    both = np.einsum("nr,nc->nrc", rows, columns).reshape(len(z_m), -1)
    return np.column_stack([np.ones(len(z_m)), z_m, z_m**2, z_m[:, None] * (both @ map_directions())])


@dataclass(frozen=True, slots=True)
class Choice:
    """Models that the views can separate."""

    ladder: tuple[tuple[str, ...], ...]
    """Models from simple to complex."""
    may_map: bool
    """Whether a map may be added."""
    note: str
    """Sentence on why other models are excluded and which views to take; empty if none is excluded."""

    @property
    def richest(self) -> tuple[str, ...]:
        """All terms that may be chosen."""
        return (*self.ladder[-1], "map") if self.may_map else self.ladder[-1]


def separable(samples: DepthSamples) -> Choice:
    """Determine which models the views can separate, from the positions of their boards."""
    away_m = [float(np.median(samples.true_m[rows])) for rows in rows_of_views(samples)]
    near_m, far_m = min(away_m), max(away_m)
    sentences, models = [], len(LADDER)
    if far_m < APART * near_m:
        models = 3
        sentences.append(
            f"The board was always {near_m:.2f} to {far_m:.2f} m away, which cannot tell an offset from a "
            "scale; take views from 0.5 m to 2 m"
        )
    elif far_m < FAR_APART * near_m:
        models = 4
        sentences.append(
            f"Views from {near_m:.2f} to {far_m:.2f} m do not determine a curvature; add views at twice "
            "the distance of the nearest"
        )
    unseen = int((~_seen_parts(samples)).sum())
    if unseen:
        sentences.append(
            f"{unseen} of the image's 12 parts have the board in fewer than {VIEWS_OF_A_PART} views, so that "
            "a map over the image cannot be estimated; add views with the board in its corners"
        )
    return Choice(LADDER[:models], not unseen, ". ".join(sentences))


def _seen_parts(samples: DepthSamples) -> BoolArray:
    """Return a (3, 4) mask of the image parts that show the board in enough views."""
    share = (samples.pixels + 0.5) / np.array(samples.size_px)
    column, row = np.minimum((share * MAP_SHAPE[::-1]).astype(int), np.array(MAP_SHAPE[::-1]) - 1).T
    seen = np.zeros((*MAP_SHAPE, len(samples.names)), bool)
    seen[row, column, samples.view] = True
    return seen.sum(axis=2) >= VIEWS_OF_A_PART


def rows_of_views(samples: DepthSamples) -> list[IntArray]:
    """Return the row numbers of each view's pixels, for the views that have any."""
    return [np.flatnonzero(samples.view == view) for view in np.unique(samples.view)]


def half_width(views: int, together: int = 1) -> float:
    """Return half the width of the joint 95 % intervals of ``together`` parameters, in standard errors
    (Student's t with a Bonferroni correction).
    """
    return float(stdtrit(views - 1, 1.0 - 0.025 / together))


@dataclass(frozen=True, slots=True)
class Problem:
    """Weighted problem y = X x + L e, where e are the lens's errors with mean 0 and variance 1.

    Each view counts as one observation, however large its board appears, because the error of the board's
    pose correlates the errors of its pixels.
    """

    X: FloatArray
    """(N, 14) design matrix."""
    y_m: FloatArray
    """(N,) true minus measured depth."""
    L_m: FloatArray
    """(N, P) derivatives of ``y_m`` by the independent errors of the lens."""
    sd_m: FloatArray
    """(N,) standard deviation of the noise."""
    trust: FloatArray
    """(N,) Huber weights, 1 for inliers."""
    views: list[IntArray]
    """Rows of each view."""
    witness: float = 1.0
    """Ratio of the standard deviation of a view's mean error to that of a pixel's."""

    @property
    def weights(self) -> FloatArray:
        """(N,) Huber weights divided by the variance and by the number of pixels in the view."""
        weights = self.trust / self.sd_m**2
        for rows in self.views:
            weights[rows] /= len(rows)
        return weights

    def _normal(self, columns: IntArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return each view's normal equations, (V, p + P, p + P) and (V, p + P), and the lens's prior."""
        Z = np.column_stack([self.X[:, columns], self.L_m])
        weighted = self.weights[:, None] * Z
        left = np.array([Z[rows].T @ weighted[rows] for rows in self.views])
        right = np.array([self.y_m[rows] @ weighted[rows] for rows in self.views])
        lens = [self.witness**2] * self.L_m.shape[1]
        return left, right, np.diag([*[0.0] * len(columns), *lens])

    def solve(self, columns: IntArray) -> FloatArray:
        """Return the (p,) optimal parameters."""
        left, right, lens = self._normal(columns)
        return solved(left.sum(axis=0) + lens, right.sum(axis=0))[: len(columns)]

    def _without_each(self, columns: IntArray) -> FloatArray:
        """Return (V, p + P) parameters and lens errors with each view left out in turn."""
        left, right, lens = self._normal(columns)
        whole, total = left.sum(axis=0) + lens, right.sum(axis=0)
        return np.array([solved(whole - A, total - b) for A, b in zip(left, right, strict=True)])

    def lens_cost(self, columns: IntArray) -> float:
        """Return the penalty for the fitted lens errors, per view, in the unit of squared errors over sd."""
        left, right, lens = self._normal(columns)
        x = solved(left.sum(axis=0) + lens, right.sum(axis=0))
        return float(x @ lens @ x) / len(self.views)

    def lens_shifts(self, columns: IntArray) -> FloatArray:
        """Return (p, P) derivatives of the parameters by the independent errors of the lens."""
        left, _, lens = self._normal(columns)
        whole = left.sum(axis=0)
        return solved(whole + lens, whole[:, len(columns) :])[: len(columns)]

    def covariance(self, columns: IntArray) -> FloatArray:
        """Return the (p, p) covariance of the parameters: the jackknife's over views plus the lens's."""
        each = self._without_each(columns)[:, : len(columns)]
        off, shifts = each - each.mean(axis=0), self.lens_shifts(columns)
        return (len(each) - 1) / len(each) * off.T @ off + shifts @ shifts.T

    def residuals_m(self, columns: IntArray) -> FloatArray:
        """Return (N,) true minus corrected depth."""
        return self.y_m - self.X[:, columns] @ self.solve(columns)

    def unseen_m(self, columns: IntArray) -> FloatArray:
        """Return (N,) residuals of each view, with parameters and lens fitted to the other views."""
        Z = np.column_stack([self.X[:, columns], self.L_m])
        residuals_m = np.empty_like(self.y_m)
        for rows, x in zip(self.views, self._without_each(columns), strict=True):
            residuals_m[rows] = self.y_m[rows] - Z[rows] @ x
        return residuals_m

    def mean_by_view(self, values: FloatArray) -> FloatArray:
        """Return the (V,) mean per view of (N,) values, with outliers down-weighted."""
        return np.array([np.average(values[rows], weights=self.trust[rows]) for rows in self.views])

    def rms_m(self, residuals_m: FloatArray) -> float:
        """Return the root mean square of (N,) residuals, metres, with equal weight for each view."""
        return float(np.sqrt(self.mean_by_view(residuals_m**2).mean()))


def solved(left: FloatArray, right: FloatArray) -> FloatArray:
    """Solve normal equations; if they are singular, return the solution of least norm."""
    return np.linalg.lstsq(left, right, rcond=1e-12)[0]


def robust_problem(
    samples: DepthSamples, expected_m: FloatArray, sd_m: FloatArray, choice: Choice
) -> Problem:
    """Set up the problem with Huber weights at 3 sd around the most complex model that the views allow.

    Args:
        samples: the pixels on the board.
        expected_m: (N,) noise-free measured depth, where the terms are evaluated: at the measured depth the
            noise would be on both sides and bias the scale towards 0.
        sd_m: (N,) standard deviation of the noise.
        choice: the models that are allowed.
    """
    y_m = samples.true_m - samples.measured_m
    views, plain = rows_of_views(samples), columns_of(choice.ladder[-1])
    problem = Problem(design(samples, expected_m), y_m, samples.lens_m.T, sd_m, np.ones(len(y_m)), views)
    for _ in range(HUBER_ROUNDS):
        off_sds = np.abs(problem.residuals_m(columns_of(choice.richest))) / sd_m
        problem = replace(problem, trust=HUBER_SDS / np.maximum(off_sds, HUBER_SDS))
    off = problem.mean_by_view(problem.residuals_m(plain) / sd_m)
    freedom = max(len(views) - len(plain), 1)
    return replace(problem, witness=float(np.sqrt((off**2).sum() / freedom)))


def chosen_terms(problem: Problem, choice: Choice) -> tuple[tuple[str, ...], dict[str, float]]:
    """Return the terms that held-out views justify, and the held-out RMS error of every model tried.

    A more complex model replaces a simpler one if its squared error in sd is lower by more than the standard
    error of that difference over the views, and if the interval of the added term excludes 0. Every model may
    explain the data by an error of the lens, at a cost: all views share the lens, so held-out views cannot
    distinguish a wrong focal length from a scale of the sensor.
    """
    tried: dict[str, float] = {}

    def errors(model: tuple[str, ...]) -> FloatArray:
        unseen_m = problem.unseen_m(columns_of(model))
        tried[title_of(model)] = problem.rms_m(unseen_m)
        return problem.mean_by_view((unseen_m / problem.sd_m) ** 2) + problem.lens_cost(columns_of(model))

    terms: tuple[str, ...] = ()
    least = errors(terms)
    mapped = [(*model, "map") for model in choice.ladder] if choice.may_map else []
    for model in (*choice.ladder[1:], *mapped):
        if "map" in model and not set(terms) <= set(model):
            continue
        error = errors(model)
        if _falls(least, error) and _certain(problem, model, set(model) - set(terms)):
            terms, least = model, error
    return terms, tried


def _falls(before: FloatArray, after: FloatArray) -> bool:
    """Return whether the mean of (V,) paired errors falls by more than its standard error."""
    gain = before - after
    return bool(gain.mean() > gain.std(ddof=1) / np.sqrt(len(gain)))


def _certain(problem: Problem, model: tuple[str, ...], added: Iterable[str]) -> bool:
    """Return whether every added term has a parameter whose interval excludes 0; the 95 % intervals have a
    Bonferroni correction for the term's parameters and for the number of models.
    """
    columns = columns_of(model)
    sds = np.abs(problem.solve(columns)) / np.sqrt(np.diag(problem.covariance(columns)))
    by_column = dict(zip(columns.tolist(), sds.tolist(), strict=True))
    return all(
        max(by_column[column] for column in GROUPS[term])
        > half_width(len(problem.views), len(GROUPS[term]) * len(LADDER))
        for term in added
    )
