"""Matches of two frames' features: mutual nearest descriptors that pass the ratio test, and equal tags."""

from __future__ import annotations

import numpy as np

from pipeline.registration.colour.features import LiftedFeatures
from pipeline.registration.consensus import PointPairs
from pipeline.types import ByteArray, FloatArray, IntArray

RATIO = 0.85
"""Largest ratio of the distances to the nearest and the second nearest descriptor (Lowe 2004)."""
SIZES = 1.4
"""Largest ratio of the sizes, in metres, of two features that may match."""
MOST = 600
"""Largest number of matches that are checked, most distinct first."""
ROUNDING = 1e-6
"""Squared distances of descriptors below this are rounding errors of equal ones."""
TAG_VOTES = 4.0
"""Votes of a pair of tag corners: their numbers agree, not only their looks."""
SCORE_FEATURES = 400
"""Number of each frame's strongest features that ``match_score`` compares."""


def matches(source: LiftedFeatures, target: LiftedFeatures) -> PointPairs:
    """Return the matches of two frames, those of tags first."""
    tags, tags_of_target = np.nonzero(source.tag_keys[:, None] == target.tag_keys)
    alike, alike_of_target = _mutual(source, target, None)
    return PointPairs(
        np.concatenate([source.tag_points_m[tags], source.points_m[alike]]),
        np.concatenate([target.tag_points_m[tags_of_target], target.points_m[alike_of_target]]),
        np.hypot(
            np.append(source.tag_sigma_m[tags], source.sigma_m[alike]),
            np.append(target.tag_sigma_m[tags_of_target], target.sigma_m[alike_of_target]),
        ),
        np.append(np.full(len(tags), TAG_VOTES), np.ones(len(alike))),
    )


def match_score(source: LiftedFeatures, target: LiftedFeatures) -> float:
    """Return the number of matches of the strongest features plus ``TAG_VOTES`` for each common tag corner.

    It orders many pairs of frames in short time.
    """
    same_tags = np.intersect1d(source.tag_keys, target.tag_keys)
    return float(len(_mutual(source, target, SCORE_FEATURES)[0]) + TAG_VOTES * len(same_tags))


def _mutual(source: LiftedFeatures, target: LiftedFeatures, most: int | None) -> tuple[IntArray, IntArray]:
    """Return rows, in both frames, of features that are each other's nearest and pass the ratio test.

    Only the first ``most`` features of each frame are compared; None compares all. Descriptors are compared
    as RootSIFT (Arandjelovic and Zisserman 2012), and only those of features of similar size in metres.
    """
    a, b = (_root(features.descriptors[:most]) for features in (source, target))
    if min(len(a), len(b)) < 2:
        return np.empty(0, np.intp), np.empty(0, np.intp)
    squared = 2.0 - 2.0 * (a @ b.T)
    log_a, log_b = (np.log(features.sizes_m[:most]).astype(np.float32) for features in (source, target))
    squared[np.abs(log_a[:, None] - log_b) > np.log(SIZES)] = np.inf
    rows, nearest = np.arange(len(a)), squared.argmin(axis=1)
    least, second = np.maximum(np.partition(squared, 1, axis=1)[:, :2], ROUNDING).T
    ratio = np.full(len(a), np.inf)
    known = np.isfinite(least)
    ratio[known] = np.sqrt(least[known] / second[known])
    good = (ratio <= RATIO) & (squared.argmin(axis=0)[nearest] == rows)
    rows = rows[good][np.argsort(ratio[good], kind="stable")[:MOST]]
    return rows, nearest[rows]


def _root(descriptors: ByteArray) -> FloatArray:
    """Return (N, 128) float32 RootSIFT descriptors, of unit length."""
    values = descriptors.astype(np.float32)
    return np.sqrt(values / np.maximum(values.sum(axis=1, keepdims=True), 1.0))
