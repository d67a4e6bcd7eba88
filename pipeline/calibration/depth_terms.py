"""The terms of a depth sensor's bias as a linear problem, view by view (SPEC 1.5)."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from scipy.linalg import null_space

from pipeline.calibration.depth_samples import DepthSamples
from pipeline.io.depth_correction import MAP_SHAPE, map_basis, map_means
from pipeline.types import BoolArray, FloatArray, IntArray

GROUPS = {"offset": (0,), "scale": (1,), "curvature": (2,), "map": tuple(range(3, 14))}
"""Columns of the design by the name of the term."""
LADDER: tuple[tuple[str, ...], ...] = (
    (),
    ("offset",),
    ("scale",),
    ("offset", "scale"),
    ("offset", "scale", "curvature"),
)
"""Models in the order of their complexity; the map comes on top of the one that is chosen."""
APART, FAR_APART = 1.3, 2.0
"""The farthest view over the nearest from which on an offset is told from a scale, and both from a curve."""
VIEWS_OF_A_PART = 2
"""Each of the map's 3 x 4 parts of the image must be seen in so many views."""
HUBER_SDS, HUBER_ROUNDS = 3.0, 8


def title_of(terms: Iterable[str]) -> str:
    """Of a model."""
    return " + ".join(terms) or "none"


def columns_of(terms: Iterable[str]) -> IntArray:
    """(p,) of the design."""
    return np.array([column for term in terms for column in GROUPS[term]], np.int64)


def map_directions() -> FloatArray:
    """(12, 11) orthonormal changes of the map's coefficients that leave its mean at 0."""
    return null_space(map_means().reshape(1, -1))


def design(samples: DepthSamples) -> FloatArray:
    """(N, 14) what the true depth gains by each parameter: 1, z, z^2 and z s."""
    z_m = samples.measured_m
    rows, columns = map_basis(samples.size_px, samples.pixels)
    both = np.einsum("nr,nc->nrc", rows, columns).reshape(len(z_m), -1)
    return np.column_stack([np.ones(len(z_m)), z_m, z_m**2, z_m[:, None] * (both @ map_directions())])


@dataclass(frozen=True, slots=True)
class Choice:
    """Models that the views can tell apart."""

    ladder: tuple[tuple[str, ...], ...]
    """From simple to rich."""
    may_map: bool
    """Whether a map may come on top."""
    note: str
    """What stands against the others and what to take; empty where there are none."""

    @property
    def richest(self) -> tuple[str, ...]:
        """All terms that may be chosen."""
        return (*self.ladder[-1], "map") if self.may_map else self.ladder[-1]


def separable(samples: DepthSamples) -> Choice:
    """Which models the views can tell apart, by where their boards are."""
    away_m = [float(np.median(samples.true_m[rows])) for rows in rows_of_views(samples)]
    near_m, far_m = min(away_m), max(away_m)
    said, models = [], len(LADDER)
    if far_m < APART * near_m:
        models = 3
        said.append(
            f"The board was always {near_m:.2f} to {far_m:.2f} m away, which cannot tell an offset from a "
            "scale; take views from 0.5 m to 2 m"
        )
    elif far_m < FAR_APART * near_m:
        models = 4
        said.append(
            f"Views from {near_m:.2f} to {far_m:.2f} m cannot tell a curvature; take some at twice the "
            "distance of the nearest"
        )
    unseen = int((~_seen_parts(samples)).sum())
    if unseen:
        said.append(
            f"{unseen} of the image's 12 parts have the board in fewer than {VIEWS_OF_A_PART} views, so that "
            "no map over the image is known; take views with the board in its corners"
        )
    return Choice(LADDER[:models], not unseen, ". ".join(said))


def _seen_parts(samples: DepthSamples) -> BoolArray:
    """(3, 4) whether each part of the image has the board in enough views."""
    share = (samples.pixels + 0.5) / np.array(samples.size_px)
    column, row = np.minimum((share * MAP_SHAPE[::-1]).astype(int), np.array(MAP_SHAPE[::-1]) - 1).T
    seen = np.zeros((*MAP_SHAPE, len(samples.names)), bool)
    seen[row, column, samples.view] = True
    return seen.sum(axis=2) >= VIEWS_OF_A_PART


def rows_of_views(samples: DepthSamples) -> list[IntArray]:
    """The pixels of each view that has any."""
    return [np.flatnonzero(samples.view == view) for view in np.unique(samples.view)]


@dataclass(frozen=True, slots=True)
class Problem:
    """y = X x, with weights: each view is one witness, however large its board appears."""

    X: FloatArray
    """(N, 14)"""
    y_m: FloatArray
    """(N,) true less measured depth."""
    sd_m: FloatArray
    """(N,) of the noise."""
    trust: FloatArray
    """(N,) Huber's weight, 1 for what is no outlier."""
    views: list[IntArray]
    """Rows of each view."""

    @property
    def weights(self) -> FloatArray:
        """(N,) Huber's over the variance, over the number of the view's pixels."""
        weights = self.trust / self.sd_m**2
        for rows in self.views:
            weights[rows] /= len(rows)
        return weights

    def normal(self, columns: IntArray) -> tuple[FloatArray, FloatArray]:
        """(V, p, p) and (V, p) each view's part of the normal equations in some columns."""
        weights = self.weights
        parts = [(self.X[np.ix_(rows, columns)], rows) for rows in self.views]
        left = np.array([X.T @ (weights[rows, None] * X) for X, rows in parts])
        return left, np.array([X.T @ (weights[rows] * self.y_m[rows]) for X, rows in parts])

    def solve(self, columns: IntArray) -> FloatArray:
        """(p,) parameters."""
        left, right = self.normal(columns)
        return solved(left.sum(axis=0), right.sum(axis=0))

    def without_each(self, columns: IntArray) -> FloatArray:
        """(V, p) parameters without each view in turn."""
        left, right = self.normal(columns)
        whole, total = left.sum(axis=0), right.sum(axis=0)
        pairs = zip(left, right, strict=True)
        return np.array([solved(whole - A, total - b) for A, b in pairs]).reshape(len(left), len(columns))

    def residuals_m(self, columns: IntArray, x: FloatArray) -> FloatArray:
        """(N,)"""
        return self.y_m - self.X[:, columns] @ x

    def unseen_m(self, columns: IntArray) -> FloatArray:
        """(N,) residuals of each view by the parameters without it."""
        residuals_m = np.empty_like(self.y_m)
        for rows, x in zip(self.views, self.without_each(columns), strict=True):
            residuals_m[rows] = self.y_m[rows] - self.X[np.ix_(rows, columns)] @ x
        return residuals_m

    def mean_by_view(self, squares: FloatArray) -> FloatArray:
        """(V,) of (N,) squares, outliers counting less."""
        return np.array([np.average(squares[rows], weights=self.trust[rows]) for rows in self.views])

    def rms_m(self, residuals_m: FloatArray) -> float:
        """Root of the mean over views of the mean square."""
        return float(np.sqrt(self.mean_by_view(residuals_m**2).mean()))


def solved(left: FloatArray, right: FloatArray) -> FloatArray:
    """(p,) of normal equations, the smallest where they leave something open."""
    return np.linalg.lstsq(left, right, rcond=1e-12)[0]


def robust_problem(samples: DepthSamples, sd_m: FloatArray, columns: IntArray) -> Problem:
    """With Huber's weights at 3 sd about the model of these columns, the richest that the views allow."""
    y_m = samples.true_m - samples.measured_m
    problem = Problem(design(samples), y_m, sd_m, np.ones(len(y_m)), rows_of_views(samples))
    for _ in range(HUBER_ROUNDS):
        off_sds = np.abs(problem.residuals_m(columns, problem.solve(columns))) / sd_m
        trust = HUBER_SDS / np.maximum(off_sds, HUBER_SDS)
        problem = Problem(problem.X, y_m, sd_m, trust, problem.views)
    return problem


def chosen_terms(problem: Problem, choice: Choice) -> tuple[tuple[str, ...], dict[str, float]]:
    """The terms that views held out justify, and the RMS error there by the terms of every model tried.

    A richer model takes the place of a simpler one if its error in sd, squared, is lower by more than the
    standard error of that difference over the views.
    """
    tried: dict[str, float] = {}

    def errors(model: tuple[str, ...]) -> FloatArray:
        unseen_m = problem.unseen_m(columns_of(model))
        tried[title_of(model)] = problem.rms_m(unseen_m)
        return problem.mean_by_view((unseen_m / problem.sd_m) ** 2)

    terms: tuple[str, ...] = ()
    least = errors(terms)
    for model in choice.ladder[1:]:
        if _falls(least, error := errors(model)):
            terms, least = model, error
    if choice.may_map and _falls(least, errors((*terms, "map"))):
        terms = (*terms, "map")
    return terms, tried


def _falls(before: FloatArray, after: FloatArray) -> bool:
    """Whether the mean of (V,) paired errors falls by more than its standard error."""
    gain = before - after
    return bool(gain.mean() > gain.std(ddof=1) / np.sqrt(len(gain)))
