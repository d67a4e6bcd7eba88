"""Closest-point pairs between a moving source and a fixed target (eq. 3.10)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from pipeline.config import Direction
from pipeline.geometry import apply
from pipeline.registration.sample import random_keys
from pipeline.types import FloatArray, IntArray, PointCloud


@dataclass(frozen=True, slots=True)
class Matching:
    """Pairs of points at one pose; rows of all arrays belong together."""

    source_rows: IntArray
    """(M,) rows of the source points."""
    target_rows: IntArray
    """(M,) rows of the target points."""
    moved_m: FloatArray
    """(M, 3) source points at this pose, in the target frame."""
    target_m: FloatArray
    """(M, 3)."""
    distances_m: FloatArray
    """(M,)."""

    def select(self, rows: IntArray) -> Matching:
        """The pairs at ``rows``."""
        return Matching(
            self.source_rows[rows],
            self.target_rows[rows],
            self.moved_m[rows],
            self.target_m[rows],
            self.distances_m[rows],
        )


class Matcher:
    """Finds pairs at any pose; every search tree is built once, in the frame of its own cloud."""

    def __init__(
        self,
        source: PointCloud,
        target: PointCloud,
        direction: Direction,
        features: Callable[[PointCloud], FloatArray | None] = lambda cloud: None,
    ) -> None:
        """For two clouds.

        Args:
            source: the cloud that moves.
            target: the cloud that stays.
            direction: whose points look for their nearest neighbours.
            features: gives (N, k) coordinates of a cloud's points beside x, y, z, in metres, or None.
        """
        self._source = _Cloud(source.points_m, features(source))
        self._target = _Cloud(target.points_m, features(target))
        self._direction = direction

    def match(
        self,
        T_target_source: FloatArray,
        neighbours: int = 1,
        source_share: float = 1.0,
        target_share: float = 1.0,
        gate_m: float = float("inf"),
    ) -> Matching:
        """Closest pairs in the matcher's direction at a pose.

        Args:
            T_target_source: (4, 4) rigid or similarity.
            neighbours: how many nearest points are found for each; rows come in blocks, nearest first.
            source_share: share of the source's points that take part, above 0 to 1.
            target_share: share of the target's points that take part.
            gate_m: a point whose nearest neighbour is farther may be left out, which saves its search.
        """
        source, target = self._source.subset(source_share), self._target.subset(target_share)
        moved_m = apply(T_target_source, source.points_m)
        found = []
        if self._direction != "p2q":
            found.append(target.nearest(source, moved_m, neighbours, gate_m))
        if self._direction != "q2p":
            back_m = apply(np.linalg.inv(T_target_source), target.points_m)
            scale = float(np.cbrt(np.linalg.det(T_target_source[:3, :3])))
            found.append(source.nearest(target, back_m, neighbours, gate_m / scale)[:, ::-1])
        pairs = found[0] if len(found) == 1 else np.unique(np.concatenate(found), axis=0)
        moved_m, target_m = moved_m[pairs[:, 0]], target.points_m[pairs[:, 1]]
        distances_m = np.linalg.norm(moved_m - target_m, axis=1)
        return Matching(source.rows[pairs[:, 0]], target.rows[pairs[:, 1]], moved_m, target_m, distances_m)


class _Subset:
    """Some of a cloud's points; their search tree is built at the first search."""

    def __init__(self, rows: IntArray, points_m: FloatArray, features: FloatArray | None) -> None:
        self.rows, self.points_m, self.features = rows, points_m, features
        self._tree: cKDTree | None = None
        self._reused: dict[int, _NearestCache] = {}

    def nearest(self, queries: _Subset, places_m: FloatArray, neighbours: int, gate_m: float) -> IntArray:
        """(M, 2) rows of ``queries``, whose points are at (n, 3) places, and of their nearest points here."""
        if self._tree is None:
            self._tree = cKDTree(_stacked(self.points_m, self.features))
        count = min(neighbours, len(self.points_m))
        queries_m = _stacked(places_m, queries.features)
        if count > 1 or len(self.points_m) == 1:
            found = np.asarray(self._tree.query(queries_m, k=count, workers=-1)[1]).reshape(-1)
            return np.stack([np.repeat(np.arange(len(places_m)), count), found], axis=1)
        cache = self._reused.setdefault(id(queries), _NearestCache(*queries_m.shape))
        # In more dimensions than three the distance says nothing about the gate.
        found = cache.nearest(self._tree, queries_m, gate_m if self.features is None else np.inf)
        near = np.flatnonzero(found < len(self.points_m))
        return np.stack([near, found[near]], axis=1)


class _NearestCache:
    """The nearest points of an earlier search, reused for queries that have moved too little for another.

    If a query's nearest point was at d1 and the second nearest at d2, a motion by s brings the first to
    d1 + s at most and every other to d2 - s at least: the nearest stays nearest while s < (d2 - d1) / 2.
    """

    def __init__(self, count: int, dimensions: int) -> None:
        self._found = np.zeros(count, dtype=np.intp)
        self._places_m = np.zeros((count, dimensions))
        self._safe_motion_m = np.full(count, -1.0)

    def nearest(self, tree: cKDTree, places_m: FloatArray, gate_m: float) -> IntArray:
        """(n,) exact nearest point of each (n, k) place; ``tree.n`` where none lies within the gate.

        A reused neighbour may lie beyond a gate that has shrunk since its search.
        """
        moved_m = np.sqrt(np.sum((places_m - self._places_m) ** 2, axis=1))
        search = np.flatnonzero(moved_m >= self._safe_motion_m)
        if len(search):
            distances_m, nearest = tree.query(places_m[search], k=2, distance_upper_bound=gate_m, workers=-1)
            self._found[search] = nearest[:, 0]
            self._places_m[search] = places_m[search]
            second_m = np.minimum(distances_m[:, 1], gate_m)
            missing = nearest[:, 0] == tree.n
            self._safe_motion_m[search] = np.where(missing, -1.0, 0.5 * (second_m - distances_m[:, 0]))
        return self._found


class _Cloud:
    """One cloud and the subsets of it that have been searched."""

    def __init__(self, points_m: FloatArray, features: FloatArray | None) -> None:
        self._points_m, self._features = points_m, features
        self._order = np.argsort(random_keys(points_m, 0))
        self._subsets: dict[int, _Subset] = {}

    def subset(self, share: float) -> _Subset:
        """A random share of the points, in their own order; smaller shares lie within larger ones."""
        count = min(len(self._points_m), max(6, round(share * len(self._points_m))))
        if count not in self._subsets:
            rows = np.sort(self._order[:count])
            features = None if self._features is None else self._features[rows]
            self._subsets[count] = _Subset(rows, self._points_m[rows], features)
        return self._subsets[count]


def _stacked(points_m: FloatArray, features: FloatArray | None) -> FloatArray:
    return points_m if features is None else np.concatenate([points_m, features], axis=1)
