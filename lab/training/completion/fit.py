"""How sure inferred depth is: logistic regression on validation rooms, and how well what it says holds."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize
from scipy.special import expit

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
RADII_PX = (10.0, 120.0)
"""Smallest and largest disc that is hidden, at 640 pixels width; every size as often."""
PIXELS = 400
"""Judged of each view and kind of hole."""


TAKEOVERS_PX = (0.0, 5.0, 10.0, 20.0, 40.0)
"""Distances from a rim that are tried for ``COMPLETED_FROM``, at 640 x 480."""
DIAGONAL_PX = 800.0


@dataclass(frozen=True, slots=True)
class Evidence:
    """Hole pixels of one way of filling."""

    features: FloatArray
    """(N, F)."""
    right: BoolArray
    """(N,) within 5 % of the truth."""

    @staticmethod
    def joined(parts: list[Evidence]) -> Evidence:
        """All of them in one."""
        return Evidence(
            np.vstack([part.features for part in parts]), np.concatenate([part.right for part in parts])
        )


@dataclass(frozen=True, slots=True)
class Judged:
    """Hole pixels of one room."""

    aligned: Evidence
    completed: Evidence
    errors: FloatArray
    """(5, N) AbsRel of both joined at each of the ``TAKEOVERS_PX``."""


def fit_confidence(rooms: int) -> Iterator[str]:
    """Lines: errors by the takeover; the coefficients from every other room, of the rest said and true."""
    network = DepthNetwork()
    judged = [judged_room(FIRST_SEED["validation"] + k, network) for k in range(rooms)]
    errors = np.concatenate([room.errors for room in judged], axis=1).mean(axis=1)
    yield "COMPLETED_FROM in px | AbsRel"
    for takeover_px, error in zip(TAKEOVERS_PX, errors, strict=True):
        yield f"{takeover_px:g} | {error:.4f}"
    for name, of in (("ALIGNED", lambda room: room.aligned), ("COMPLETED", lambda room: room.completed)):
        fitted = fit(Evidence.joined([of(room) for room in judged[::2]]))
        yield f"{name}_ODDS = " + ", ".join(f"{value:.2f}" for value in fitted)
        yield "said | true | pixels"
        yield from calibration(fitted, Evidence.joined([of(room) for room in judged[1::2]]))


def judged_room(seed: int, network: DepthNetwork) -> Judged:
    """Pixels of the sensor's own holes and of hidden discs, in every view of one room."""
    rng = np.random.default_rng(seed)
    parts = [
        judged_view(example, hidden & example.sensor.valid, network, rng)
        for example in held_out_rooms(range(seed, seed + 1), VIEWS)
        for hidden in (np.zeros(example.truth_m.shape, bool), disc(example.truth_m.shape, rng))
    ]
    return Judged(
        Evidence.joined([part.aligned for part in parts]),
        Evidence.joined([part.completed for part in parts]),
        np.concatenate([part.errors for part in parts], axis=1),
    )


def judged_view(
    example: Example, hidden: BoolArray, network: DepthNetwork, rng: np.random.Generator
) -> Judged:
    """Some of the hidden pixels; of the sensor's own holes if none are."""
    sensor = DepthMap(np.where(hidden, np.float32(np.nan), example.sensor.z_m))
    measured, distance = sensor.valid, distance_to_measured(sensor.valid)
    alignment = align_depth(network.infer(example.rgb), sensor, "local")
    rims = meet_rims(alignment, sensor, example.rgb)
    completed = complete(sensor, example.rgb)
    holes = hidden if hidden.any() else ~measured & np.isfinite(example.truth_m)
    chosen = rng.permutation(np.flatnonzero(holes & rims.valid))[:PIXELS]

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


def disc(shape: tuple[int, int], rng: np.random.Generator) -> BoolArray:
    """(H, W) a disc anywhere."""
    radius_px = np.exp(rng.uniform(*np.log(RADII_PX))) * shape[1] / 640.0
    y, x = np.indices(shape) - (rng.random(2) * shape)[:, None, None]
    return np.hypot(y, x) < radius_px


def fit(evidence: Evidence) -> FloatArray:
    """(1 + F,) constant and weights of the features that make what was found most likely."""
    sign = 2.0 * evidence.right - 1.0
    rows = np.hstack([np.ones((len(sign), 1)), evidence.features])
    start = np.zeros(rows.shape[1])
    return minimize(lambda w: np.mean(np.logaddexp(0.0, -sign * (rows @ w))), start).x


def calibration(fitted: FloatArray, evidence: Evidence) -> Iterator[str]:
    """Of the pixels in every tenth of confidence: said, true and how many."""
    said = expit(fitted[0] + evidence.features @ fitted[1:])
    for low in np.arange(0.0, 1.0, 0.1):
        inside = (said >= low) & (said < low + 0.1)
        if inside.any():
            yield f"{said[inside].mean():.1%} | {evidence.right[inside].mean():.1%} | {inside.sum()}"
