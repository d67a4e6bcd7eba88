"""Consensus of pairs of points for one rigid motion, among many wrong pairs, without random samples.

Two right pairs keep the distance of their points; counting, for two pairs, the others that agree with both
separates right from wrong pairs even where nine of ten are wrong (Chen et al., "SC2-PCR: a second order
spatial compatibility for efficient and robust point cloud registration", CVPR 2022).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from pipeline.kernels.geometry import apply, rotation_angle_rad
from pipeline.registration.residual import DegenerateError, weighted_procrustes
from pipeline.types import BoolArray, FloatArray

WITHIN_SD = 3.0
"""A pair fits a motion at a distance below this many standard deviations, or below ``least_m``."""
SEEDS = 40
"""Largest number of pairs from which a motion is computed, those with most agreement first."""
GROUP = 12
"""Largest number of pairs that agree with a seed, from which its first motion is computed."""
ROUNDS = 4
"""Number of times that a motion is computed: first from a seed's group, then from the pairs that fit it."""
FLAT = 0.2
"""Points are in one plane if their spread across it is below this share of the smaller one along it."""
OTHER_RAD = np.radians(10.0)


@dataclass(frozen=True, slots=True)
class PointPairs:
    """Pairs of points that may be the same point; many pairs are wrong."""

    source_m: FloatArray
    """(M, 3) points of the source."""
    target_m: FloatArray
    """(M, 3) points of the target."""
    sigma_m: FloatArray
    """(M,) standard deviation of the pair's distance at the right pose."""
    votes: FloatArray
    """(M,) votes of a pair for a pose that it fits."""

    def __len__(self) -> int:
        return len(self.votes)


@dataclass(frozen=True, slots=True)
class Scale:
    """Lengths of the place; the defaults suit a room that a camera sees."""

    least_m: float = 0.02
    """A pair at this distance fits, however small its standard deviation."""
    shortest_m: float = 0.05
    """Pairs nearer to each other than this say little about a motion, and are not compared."""
    other_m: float = 0.3
    """Motions that differ by more, or by 10 degrees, are different answers."""
    from_origin: bool = True
    """Whether both were seen from their origins; then motions that show a plane from behind are rejected."""


ROOM = Scale()


class Motion(NamedTuple):
    """A motion, and the pairs that fit it."""

    T_target_source: FloatArray
    inliers: BoolArray
    """(M,) True for the pairs that fit."""
    votes: float
    """Votes of the pairs that fit; a pair counts less, the farther it is off."""


def consensus(pairs: PointPairs, scale: Scale = ROOM) -> list[Motion]:
    """Return clearly different rigid motions, those with most votes first; empty if no three pairs agree."""
    if len(pairs) < 3:
        return []
    limit_m = np.maximum(WITHIN_SD * pairs.sigma_m, scale.least_m)
    agreement = _agreement(pairs, limit_m, scale.shortest_m)
    strength = agreement @ pairs.votes.astype(np.float32)
    found: list[Motion] = []
    explained = np.zeros(len(pairs), bool)
    for seed in np.argsort(-strength, kind="stable")[:SEEDS]:
        if explained[seed] or not strength[seed] > 0.0:
            continue
        group = np.argsort(-agreement[seed], kind="stable")[:GROUP]
        group = np.append(group[agreement[seed, group] > 0.0], seed)
        motion = _refined(pairs, limit_m, group, scale.from_origin)
        if motion is not None:
            found.append(motion)
            explained |= motion.inliers
    different: list[Motion] = []
    for one in sorted(found, key=lambda one: -one.votes):
        if all(_differ(one.T_target_source, other.T_target_source, scale.other_m) for other in different):
            different.append(one)
    return different


def _agreement(pairs: PointPairs, limit_m: FloatArray, shortest_m: float) -> FloatArray:
    """Return (M, M): for two pairs that agree, the votes of the pairs that agree with both; else 0."""
    apart_source_m, apart_target_m = _distances_m(pairs.source_m), _distances_m(pairs.target_m)
    tolerance_m = np.hypot(limit_m[:, None], limit_m)
    same = np.abs(apart_source_m - apart_target_m) < tolerance_m
    same &= np.minimum(apart_source_m, apart_target_m) > shortest_m
    agree = same.astype(np.float32)
    return agree * ((agree * pairs.votes.astype(np.float32)) @ agree)


def _distances_m(points_m: FloatArray) -> FloatArray:
    """Return the (M, M) distances of (M, 3) points."""
    centred_m = points_m - points_m.mean(axis=0)
    squared = np.einsum("mi,mi->m", centred_m, centred_m)
    return np.sqrt(np.maximum(squared[:, None] + squared - 2.0 * centred_m @ centred_m.T, 0.0))


def _refined(pairs: PointPairs, limit_m: FloatArray, rows: np.ndarray, from_origin: bool) -> Motion | None:
    """Return the motion of some pairs, computed again from all that fit it.

    It is None if fewer than 3 pairs fit, if they are on one line, or if they show a plane from behind.
    """
    try:
        for _ in range(ROUNDS):
            if len(rows) < 3:
                return None
            weights = pairs.votes[rows] / limit_m[rows] ** 2
            T = weighted_procrustes(pairs.source_m[rows], pairs.target_m[rows], weights)
            off = np.linalg.norm(apply(T, pairs.source_m) - pairs.target_m, axis=1) / limit_m
            rows = np.flatnonzero(off < 1.0)
    except DegenerateError:
        return None
    inliers = off < 1.0
    if inliers.sum() < 3 or (from_origin and _from_behind(pairs.target_m[inliers], T)):
        return None
    votes = float(np.sum(pairs.votes[inliers] * (1.0 - off[inliers] ** 2)))
    return Motion(T, inliers, votes)


def _from_behind(target_m: FloatArray, T_target_source: FloatArray) -> bool:
    """Return whether the cameras would see opposite sides of one plane with all points, as in a mirror image.

    Args:
        target_m: (M, 3) points in the target's camera, which is at the origin.
        T_target_source: (4, 4) pose of the source's camera.
    """
    middle_m = target_m.mean(axis=0)
    _, spread, axes = np.linalg.svd(target_m - middle_m, full_matrices=False)
    sides = axes[2] @ middle_m, axes[2] @ (middle_m - T_target_source[:3, 3])
    return bool(spread[2] < FLAT * spread[1] and sides[0] * sides[1] < 0.0)


def _differ(T_a: FloatArray, T_b: FloatArray, other_m: float) -> bool:
    apart_m = float(np.linalg.norm(T_a[:3, 3] - T_b[:3, 3]))
    return apart_m > other_m or rotation_angle_rad(T_a[:3, :3].T @ T_b[:3, :3]) > OTHER_RAD
