"""Random samples of clouds for a registration, with checks of the points."""

from __future__ import annotations

import weakref
from dataclasses import dataclass, replace

import numpy as np

from packetmesh.errors import InputError
from pipeline.kernels.kdtree import compiled
from pipeline.types import FloatArray, IntArray, PointCloud

_KEY_PERIODS = (1e5, 2e5)
"""Range of the number of key periods per mean squared distance, drawn by the seed: large enough that points
0.01 mm apart have unrelated keys, small enough that rounding hardly changes a key."""


@dataclass(frozen=True, slots=True)
class Sample:
    """A random subset of a cloud, in the cloud's own order."""

    cloud: PointCloud
    """The drawn points with all their columns; float64."""
    rows: IntArray
    """(n,) rows of the drawn points in the whole cloud."""

    @property
    def points_m(self) -> FloatArray:
        """(n, 3) drawn points."""
        return self.cloud.points_m


def draw(cloud: PointCloud, max_points: int, seed: int, name: str) -> Sample:
    """Draw ``max_points`` random points of the cloud, or take all of a smaller cloud.

    Source and target are drawn with the same seed, so that a cloud registered to itself does not move. The
    choice of points depends neither on their order nor on the frame or the unit.

    Args:
        cloud: any cloud.
        max_points: number of points to draw.
        seed: random seed; another seed draws other points.
        name: name of the cloud in error messages.

    Raises:
        InputError: fewer than three points, or coordinates that are not finite.
    """
    if len(cloud) < 3:
        raise InputError(
            f"The {name} cloud has {len(cloud)} points; registration needs at least three, "
            "so check its depth image or file."
        )
    if not np.isfinite(cloud.points_m).all():
        bad = np.count_nonzero(~np.isfinite(cloud.points_m).all(axis=1))
        raise InputError(
            f"The {name} cloud has {bad} points with NaN or infinite coordinates; remove them first."
        )
    rows = drawn_rows(cloud.points_m, max_points, seed)
    chosen = cloud.select(rows)
    return Sample(replace(chosen, points_m=chosen.points_m.astype(np.float64)), rows)


def drawn_rows(points_m: FloatArray, count: int, seed: int = 0) -> IntArray:
    """Return (count,) ascending rows of a random choice of (N, 3) points, by ``random_keys``; at most N."""
    if len(points_m) <= count:
        return np.arange(len(points_m))
    return np.sort(np.argpartition(random_keys(points_m, seed), count)[:count])


def random_keys(points_m: FloatArray, seed: int) -> FloatArray:
    """Compute (N,) pseudo-random numbers in [0, 1) for a random choice among (N, 3) points.

    A key depends only on the point's distance to the cloud's centre, relative to the cloud's size: it does
    not change if the points are reordered or the whole cloud is moved or scaled. Keys are cached while the
    array exists (it must not change), because a node of a rig is sampled for every pair that it is in.
    """
    known = _keys.get((id(points_m), seed))
    if known is not None:
        return known
    squared = _squared_arms(np.ascontiguousarray(points_m, np.float64))
    periods = np.random.default_rng(seed).uniform(*_KEY_PERIODS)
    phases = periods / max(float(squared.mean()), np.finfo(float).tiny) * squared
    keys = _keys[id(points_m), seed] = phases - np.floor(phases)
    weakref.finalize(points_m, _keys.pop, (id(points_m), seed), None)
    return keys


@compiled
def _squared_arms(points: FloatArray) -> FloatArray:
    """Compute (N,) squared distances of (N, 3) points from their mean."""
    mean, squared = np.zeros(3), np.empty(len(points))
    for i in range(len(points)):
        for axis in range(3):
            mean[axis] += points[i, axis]
    mean /= len(points)
    for i in range(len(points)):
        arms = points[i, 0] - mean[0], points[i, 1] - mean[1], points[i, 2] - mean[2]
        squared[i] = arms[0] * arms[0] + arms[1] * arms[1] + arms[2] * arms[2]
    return squared


_keys: dict[tuple[int, int], FloatArray] = {}
