"""Closest-point pairs between a moving source and a fixed target (eq. 3.10)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from pipeline.config import Direction
from pipeline.geometry import apply
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
        self._source = _Side(source.points_m, features(source))
        self._target = _Side(target.points_m, features(target))
        self._direction = direction

    def match(
        self,
        T_target_source: FloatArray,
        neighbours: int = 1,
        source_share: float = 1.0,
        target_share: float = 1.0,
    ) -> Matching:
        """Closest pairs in the matcher's direction at a (4, 4) rigid or similarity pose."""
        source, target = self._source.part(source_share), self._target.part(target_share)
        moved_m = apply(T_target_source, source.points_m)
        found = []
        if self._direction != "p2q":
            asking, nearest = target.nearest(moved_m, source.features, neighbours)
            found.append(np.stack([asking, nearest], axis=1))
        if self._direction != "q2p":
            back_m = apply(np.linalg.inv(T_target_source), target.points_m)
            asking, nearest = source.nearest(back_m, target.features, neighbours)
            found.append(np.stack([nearest, asking], axis=1))
        pairs = found[0] if len(found) == 1 else np.unique(np.concatenate(found), axis=0)
        moved_m, target_m = moved_m[pairs[:, 0]], target.points_m[pairs[:, 1]]
        distances_m = np.linalg.norm(moved_m - target_m, axis=1)
        return Matching(source.rows[pairs[:, 0]], target.rows[pairs[:, 1]], moved_m, target_m, distances_m)


class _Part:
    """Some of a cloud's points, searchable from the first time somebody asks."""

    def __init__(self, rows: IntArray, points_m: FloatArray, features: FloatArray | None) -> None:
        self.rows, self.points_m, self.features = rows, points_m, features
        self._tree: cKDTree | None = None

    def nearest(
        self, points_m: FloatArray, features: FloatArray | None, neighbours: int
    ) -> tuple[IntArray, IntArray]:
        """Who asks and whom it finds: (n * k,) rows of ``points_m`` and of this part, nearest first."""
        if self._tree is None:
            self._tree = cKDTree(_stacked(self.points_m, self.features))
        count = min(neighbours, len(self.points_m))
        _, nearest = self._tree.query(_stacked(points_m, features), k=count, workers=-1)
        return np.repeat(np.arange(len(points_m)), count), np.asarray(nearest).reshape(-1)


class _Side:
    """One cloud and the parts of it that have been asked for."""

    def __init__(self, points_m: FloatArray, features: FloatArray | None) -> None:
        self._points_m, self._features = points_m, features
        self._order = np.random.default_rng(0).permutation(len(points_m))
        self._parts: dict[int, _Part] = {}

    def part(self, share: float) -> _Part:
        """A random share of the points, in their own order; smaller shares lie within larger ones."""
        count = min(len(self._points_m), max(6, round(share * len(self._points_m))))
        if count not in self._parts:
            rows = np.sort(self._order[:count])
            features = None if self._features is None else self._features[rows]
            self._parts[count] = _Part(rows, self._points_m[rows], features)
        return self._parts[count]


def _stacked(points_m: FloatArray, features: FloatArray | None) -> FloatArray:
    return points_m if features is None else np.concatenate([points_m, features], axis=1)
