"""How sure completed depth is: logistic regression on validation rooms, and how well what it says holds."""

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
from pipeline.depth.confidence import distance_to_measured, features_of_completion, joined, meet_rims
from pipeline.types import BoolArray, DepthMap, FloatArray

VIEWS = 2
RADII_PX = (10.0, 120.0)
"""Smallest and largest disc that is hidden, at 640 pixels width; every size as often."""
PIXELS = 400
"""Judged of each view and kind of hole."""


@dataclass(frozen=True, slots=True)
class Judged:
    """Hole pixels of one room."""

    features: FloatArray
    """(N, 4) of ``features_of_completion``."""
    right: BoolArray
    """(N,) within 5 % of the truth."""


def fit_confidence(rooms: int) -> Iterator[str]:
    """Lines: the coefficients from every other validation room, and of the rest what is said and true."""
    network = DepthNetwork()
    judged = [judged_room(FIRST_SEED["validation"] + k, network) for k in range(rooms)]
    fitted = fit(judged[::2])
    yield "COMPLETED_ODDS = " + ", ".join(f"{value:.2f}" for value in fitted)
    yield "said | true | pixels"
    yield from calibration(fitted, judged[1::2])


def judged_room(seed: int, network: DepthNetwork) -> Judged:
    """Pixels of the sensor's own holes and of hidden discs, in every view of one room."""
    rng = np.random.default_rng(seed)
    parts = [
        judged_view(example, hidden & example.sensor.valid, network, rng)
        for example in held_out_rooms(range(seed, seed + 1), VIEWS)
        for hidden in (np.zeros(example.truth_m.shape, bool), disc(example.truth_m.shape, rng))
    ]
    features, right = zip(*((part.features, part.right) for part in parts), strict=True)
    return Judged(np.vstack(features), np.concatenate(right))


def judged_view(
    example: Example, hidden: BoolArray, network: DepthNetwork, rng: np.random.Generator
) -> Judged:
    """Some of the hidden pixels; of the sensor's own holes if none are."""
    sensor = DepthMap(np.where(hidden, np.float32(np.nan), example.sensor.z_m))
    measured, distance = sensor.valid, distance_to_measured(sensor.valid)
    rims = meet_rims(align_depth(network.infer(example.rgb), sensor, "local"), sensor, example.rgb)
    completed = complete(sensor, example.rgb)
    filled = joined(rims, completed, measured, distance)
    holes = hidden if hidden.any() else ~measured & np.isfinite(example.truth_m)
    chosen = rng.permutation(np.flatnonzero(holes))[:PIXELS]
    features = features_of_completion(rims, completed, distance).reshape(4, -1).T
    ratio = filled.z_m.ravel()[chosen] / example.truth_m.ravel()[chosen]
    return Judged(features[chosen], np.abs(ratio - 1.0) < INLIER_SHARE_OF_DEPTH)


def disc(shape: tuple[int, int], rng: np.random.Generator) -> BoolArray:
    """(H, W) a disc anywhere."""
    radius_px = np.exp(rng.uniform(*np.log(RADII_PX))) * shape[1] / 640.0
    y, x = np.indices(shape) - (rng.random(2) * shape)[:, None, None]
    return np.hypot(y, x) < radius_px


def fit(judged: list[Judged]) -> FloatArray:
    """(5,) constant and weights of the features that make what was found most likely."""
    features = np.vstack([room.features for room in judged])
    sign = 2.0 * np.concatenate([room.right for room in judged]) - 1.0
    rows = np.hstack([np.ones((len(features), 1)), features])
    return minimize(lambda w: np.mean(np.logaddexp(0.0, -sign * (rows @ w))), np.zeros(5)).x


def calibration(fitted: FloatArray, judged: list[Judged]) -> Iterator[str]:
    """Of the pixels in every tenth of confidence: said, true and how many."""
    features = np.vstack([room.features for room in judged])
    right = np.concatenate([room.right for room in judged])
    said = expit(fitted[0] + features @ fitted[1:])
    for low in np.arange(0.0, 1.0, 0.1):
        inside = (said >= low) & (said < low + 0.1)
        if inside.any():
            yield f"{said[inside].mean():.1%} | {right[inside].mean():.1%} | {inside.sum()}"
