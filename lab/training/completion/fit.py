"""Fit of the confidence in inferred depth: logistic regression on validation rooms, and its calibration."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize
from scipy.special import expit

from lab.benchmarks.hidden_depth import hide
from lab.training.dataset import FIRST_SEED
from lab.training.evaluate import Example, held_out_rooms
from pipeline.depth import DepthNetwork, align_depth, complete
from pipeline.depth.alignment import INLIER_SHARE_OF_DEPTH
from pipeline.depth.confidence import (
    distance_to_measured,
    features_of_alignment,
    features_of_completion,
    joined,
    meet_rims,
)
from pipeline.types import BoolArray, DepthMap, FloatArray

VIEWS = 2
HIDDEN_SHARE = 0.15
"""Share of the measured pixels that is hidden in each view."""
ONE_IN = 25
"""One in so many hole pixels of each view is used, so that a large hole counts more than a small one."""
TAKEOVERS_PX = (0.0, 5.0, 10.0, 20.0, 40.0)
"""Distances from a hole's rim, at 640 x 480, that are tried for ``COMPLETED_FROM``."""
DIAGONAL_PX = 800.0
"""Diagonal of an image of 640 x 480 pixels."""


@dataclass(frozen=True, slots=True)
class Evidence:
    """Features and correctness of hole pixels filled by one method."""

    features: FloatArray
    """(N, F) features."""
    right: BoolArray
    """(N,) whether the depth is within 5 % of the truth."""

    @staticmethod
    def joined(parts: list[Evidence]) -> Evidence:
        """Return all parts as one."""
        return Evidence(
            np.vstack([part.features for part in parts]), np.concatenate([part.right for part in parts])
        )


@dataclass(frozen=True, slots=True)
class Judged:
    """Hole pixels of one kind, filled by both methods."""

    aligned: Evidence
    completed: Evidence
    errors: FloatArray
    """(5, N) relative error of the two methods joined at each of the ``TAKEOVERS_PX``."""

    @staticmethod
    def joined(parts: list[Judged]) -> Judged:
        """Return all parts as one."""
        return Judged(
            Evidence.joined([part.aligned for part in parts]),
            Evidence.joined([part.completed for part in parts]),
            np.concatenate([part.errors for part in parts], axis=1),
        )


def fit_confidence(rooms: int) -> Iterator[str]:
    """Yield lines of text: the error at each takeover, and the fitted coefficients with their calibration.

    The coefficients are fitted on every other room, and their calibration is measured on the others.

    Args:
        rooms: number of validation rooms, at least 2.
    """
    network = DepthNetwork()
    judged = [judged_room(FIRST_SEED["validation"] + k, network) for k in range(rooms)]
    errors = np.concatenate([kind.errors for room in judged for kind in room], axis=1).mean(axis=1)
    yield "COMPLETED_FROM in px | AbsRel"
    for takeover_px, error in zip(TAKEOVERS_PX, errors, strict=True):
        yield f"{takeover_px:g} | {error:.4f}"
    for name, of in (
        ("ALIGNED", lambda room: room[0].aligned),
        ("COMPLETED", lambda room: room[0].completed),
        ("HIDDEN", lambda room: room[1].completed),
    ):
        fitted = fit(Evidence.joined([of(room) for room in judged[::2]]))
        yield f"{name}_ODDS = " + ", ".join(f"{value:.2f}" for value in fitted)
        yield "mean confidence | share that is right | pixels"
        yield from calibration(fitted, Evidence.joined([of(room) for room in judged[1::2]]))


def judged_room(seed: int, network: DepthNetwork) -> tuple[Judged, Judged]:
    """Return the judged pixels of the sensor's own holes, and of hidden depth, in all views of one room."""
    rng = np.random.default_rng(seed)
    own, measured = [], []
    for example in held_out_rooms(range(seed, seed + 1), VIEWS):
        hidden = hide(example.sensor, rng, HIDDEN_SHARE)
        own.append(judged_view(example, np.zeros_like(hidden), network, rng))
        measured.append(judged_view(example, hidden, network, rng))
    return Judged.joined(own), Judged.joined(measured)


def judged_view(
    example: Example, hidden: BoolArray, network: DepthNetwork, rng: np.random.Generator
) -> Judged:
    """Fill a view by both methods; return some hidden pixels, or some of its own holes if none is hidden."""
    sensor = DepthMap(np.where(hidden, np.float32(np.nan), example.sensor.z_m))
    measured, distance = sensor.valid, distance_to_measured(sensor.valid)
    alignment = align_depth(network.infer(example.rgb), sensor, "local")
    rims = meet_rims(alignment, sensor, example.rgb)
    completed = complete(sensor, example.rgb)
    holes = hidden if hidden.any() else ~measured & np.isfinite(example.truth_m)
    inside = np.flatnonzero(holes & rims.valid)
    chosen = rng.permutation(inside)[: -(-len(inside) // ONE_IN)]

    def errors(depth: DepthMap) -> FloatArray:
        return np.abs(depth.z_m.ravel()[chosen] / example.truth_m.ravel()[chosen] - 1.0)

    def evidence(features: FloatArray, depth: DepthMap) -> Evidence:
        rows = features.reshape(len(features), -1).T[chosen]
        return Evidence(rows, errors(depth) < INLIER_SHARE_OF_DEPTH)

    takeovers = [
        errors(joined(rims, completed, measured, distance, max(takeover_px, 1e-3) / DIAGONAL_PX))
        for takeover_px in TAKEOVERS_PX
    ]
    filled = joined(rims, completed, measured, distance)
    return Judged(
        evidence(features_of_alignment(alignment, sensor, distance), rims),
        evidence(features_of_completion(rims, completed, distance), filled),
        np.stack(takeovers),
    )


def fit(evidence: Evidence) -> FloatArray:
    """Return (1 + F,) most likely coefficients of the log odds: the constant, then a weight per feature."""
    sign = 2.0 * evidence.right - 1.0
    rows = np.hstack([np.ones((len(sign), 1)), evidence.features])
    start = np.zeros(rows.shape[1])
    return minimize(lambda w: np.mean(np.logaddexp(0.0, -sign * (rows @ w))), start).x


def calibration(fitted: FloatArray, evidence: Evidence) -> Iterator[str]:
    """Yield a line for each tenth of confidence: mean confidence, share of right pixels, number of pixels."""
    confidence = expit(fitted[0] + evidence.features @ fitted[1:])
    for low in np.arange(0.0, 1.0, 0.1):
        inside = (confidence >= low) & (confidence < low + 0.1)
        if inside.any():
            yield f"{confidence[inside].mean():.1%} | {evidence.right[inside].mean():.1%} | {inside.sum()}"
