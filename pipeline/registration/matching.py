"""Closest-point pairs between a moving source and a fixed target (eq. 3.10)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Protocol

import numpy as np
from scipy.spatial import cKDTree

from pipeline.config import Direction
from pipeline.kernels.kdtree import (
    KdTree,
    compiled,
    in_parts,
    search,
    squared_distance,
    tree_of,
    working_space,
)
from pipeline.kernels.point_sets import ascending
from pipeline.registration.neighbourhood import Normals
from pipeline.registration.sample import random_keys
from pipeline.types import ByteArray, FloatArray, IntArray, PointCloud


@dataclass(frozen=True, slots=True)
class Matching:
    """Pairs of points at one pose; row m of each array is for pair m."""

    source_rows: IntArray
    """(M,) rows of the source points."""
    target_rows: IntArray
    """(M,) rows of the target points."""
    moved_m: FloatArray
    """(M, 3) source points at this pose, in the target frame."""
    target_m: FloatArray
    """(M, 3) target points."""
    distances_m: FloatArray
    """(M,) distances of the pairs."""
    normals: FloatArray | None = None
    """(M, 3) unit mean of both points' normals in the target frame; None from a matcher without them."""
    cosines: FloatArray | None = None
    """(M,) cosine of the angle between both points' normals, without its sign; None like ``normals``."""

    def select(self, rows: IntArray) -> Matching:
        """Return the pairs at ``rows``, which must be ascending."""
        if len(rows) == len(self.distances_m):
            return self
        return Matching(
            self.source_rows.take(rows),
            self.target_rows.take(rows),
            self.moved_m.take(rows, axis=0),
            self.target_m.take(rows, axis=0),
            self.distances_m.take(rows),
            None if self.normals is None else self.normals.take(rows, axis=0),
            None if self.cosines is None else self.cosines.take(rows),
        )


class Matches(Protocol):
    """Finds the closest pairs of two clouds at any pose."""

    target_normals: Normals
    """Normals of all points of the target."""

    def match(
        self,
        T_target_source: FloatArray,
        neighbours: int = 1,
        source_share: float = 1.0,
        target_share: float = 1.0,
        gate_m: float = float("inf"),
    ) -> Matching:
        """Find the pairs at a pose; see ``Matcher.match``."""
        ...


BEYOND_GATE = 1.5
"""Ratio of the search radius for the nearest point to the gate."""


class Matcher:
    """Finds the closest pairs at any pose; each search tree is built once, in the frame of its cloud."""

    def __init__(
        self,
        source: PointCloud,
        target: PointCloud,
        direction: Direction,
        features: Callable[[PointCloud], FloatArray | None] = lambda cloud: None,
        with_normals: bool = False,
    ) -> None:
        """Prepare the matching of two clouds.

        Args:
            source: the cloud that moves.
            target: the cloud that stays.
            direction: q2p searches each source point's nearest target point, p2q the reverse, both does both.
            features: returns (N, k) further coordinates of a cloud's points after x, y, z, metres, or None.
            with_normals: whether matchings have the pairs' normals.
        """
        self._source = _Cloud(source.points_m, features(source))
        self._target = _Cloud(target.points_m, features(target))
        self._direction = direction
        self._source_normals = _normals_of(source, self._source) if with_normals else None
        self.target_normals = _normals_of(target, self._target)
        """Normals of all points of the target: its own, or from its points."""

    def match(
        self,
        T_target_source: FloatArray,
        neighbours: int = 1,
        source_share: float = 1.0,
        target_share: float = 1.0,
        gate_m: float = float("inf"),
    ) -> Matching:
        """Find the closest pairs at a pose, in the matcher's direction.

        Args:
            T_target_source: (4, 4) rigid or similarity transform.
            neighbours: number of nearest points for each point; pairs come in blocks, nearest first,
                except with the direction ``both``.
            source_share: share of the source's points that are used, above 0 to 1.
            target_share: share of the target's points that are used.
            gate_m: points whose nearest neighbour is farther may be left out, which saves time.
        """
        source, target = self._source.subset(source_share), self._target.subset(target_share)
        moved_m = _moved(T_target_source, source.points_m)
        found = []
        if self._direction != "p2q":
            found.append(target.nearest(source, moved_m, neighbours, gate_m))
        if self._direction != "q2p":
            back_m = _moved(np.linalg.inv(T_target_source), target.points_m)
            scale = float(np.cbrt(np.linalg.det(T_target_source[:3, :3])))
            found.append(source.nearest(target, back_m, neighbours, gate_m / scale)[::-1])
        near, partners = found[0] if len(found) == 1 else _either(found[0], found[1], len(target.rows))
        pairs = Matching(*_pairs(near, partners, moved_m, target.points_m, source.rows, target.rows))
        return pairs if self._source_normals is None else self._facing(pairs, T_target_source)

    def _facing(self, pairs: Matching, T_target_source: FloatArray) -> Matching:
        """Return the pairs with their normals."""
        assert self._source_normals is not None
        rows = pairs.source_rows, pairs.target_rows
        moving, fixed = self._source_normals.all, self.target_normals.all
        normals, cosines = mean_normals(T_target_source, moving, fixed, *rows)
        return replace(pairs, normals=normals, cosines=cosines)


class _Subset:
    """A subset of a cloud's points, whose search structures are built at the first search."""

    def __init__(self, cloud: _Cloud, rows: IntArray) -> None:
        self.cloud, self.rows = cloud, rows
        whole = len(rows) == len(cloud.points_m)
        self.points_m = np.ascontiguousarray(cloud.points_m if whole else cloud.points_m.take(rows, axis=0))

    @cached_property
    def features(self) -> FloatArray | None:
        """(n, k) further coordinates after x, y, z, or None."""
        return None if self.cloud.features is None else self.cloud.features[self.rows]

    def nearest(
        self, queries: _Subset, places_m: FloatArray, neighbours: int, gate_m: float
    ) -> tuple[IntArray, IntArray]:
        """Return (M,) rows of ``queries``, now at (n, 3) ``places_m``, and of their nearest points here."""
        count = min(neighbours, len(self.points_m))
        if count > 1 or self.features is not None:
            queries_m = _stacked(places_m, queries.features)
            found = np.asarray(self._any_tree.query(queries_m, k=count, workers=-1)[1]).reshape(-1)
            return np.repeat(np.arange(len(places_m)), count), found
        if self._partners is None:
            self._partners = _Partners(self.tree, len(queries.cloud.points_m))
        found = self._partners.nearest(queries.rows, places_m, gate_m)
        return _paired(found)

    _partners: _Partners | None = None

    @cached_property
    def tree(self) -> KdTree:
        """Search tree of these points; its rows refer to their order in this subset."""
        return tree_of(self.points_m)

    @cached_property
    def _any_tree(self) -> cKDTree:
        """Search tree for several neighbours, and for more than three coordinates."""
        return cKDTree(_stacked(self.points_m, self.features))


class _Partners:
    """Nearest points of one cloud's points in another; searched again only if they may have changed.

    If a point's nearest was at d1 and the second nearest at d2, a motion by s brings the first to d1 + s at
    most and every other to d2 - s at least: the nearest stays nearest while s < (d2 - d1) / 2, and none is
    within a gate g while s < d1 - g. A search radius larger than the gate saves the search for points without
    a partner after small motions. A search starts with the distances of the old two points, which excludes
    most others.
    """

    def __init__(self, tree: KdTree, count: int) -> None:
        """Prepare for ``count`` points that are matched to the points of a tree."""
        self._tree = tree
        self._two = np.full((count, 2), -1, dtype=np.intp)
        """Nearest and second nearest point, in the tree's order; -1 if none is within the search radius."""
        self._places_m = np.zeros((count, 3))
        """Position of each point at its last search."""
        self._clear_m = np.full((count, 2), -np.inf)
        """Lower limits of the distances to the nearest and the second nearest point at that position."""

    def nearest(self, rows: IntArray, places_m: FloatArray, gate_m: float) -> IntArray:
        """Find the nearest points of the points ``rows``, which are at (n, 3) ``places_m``.

        Returns:
            (n,) rows of the nearest points, -1 where none is within the gate.
        """
        found = np.empty(len(rows), dtype=np.intp)
        tree, state = (*self._tree.parts, self._tree.order), (self._two, self._places_m, self._clear_m)

        def work(first: int, last: int) -> None:
            _nearest(*tree, rows, places_m, first, last, gate_m, *state, found)

        in_parts(work, len(rows))
        return found


@compiled
def _moved(T: FloatArray, points: FloatArray) -> FloatArray:
    """Transform (n, 3) points by a (4, 4) motion, as ``geometry.apply`` does, without a library's threads."""
    moved = np.empty_like(points)
    for i in range(len(points)):
        for k in range(3):
            moved[i, k] = T[k, 0] * points[i, 0] + T[k, 1] * points[i, 1] + T[k, 2] * points[i, 2] + T[k, 3]
    return moved


@compiled
def _nearest(
    points: FloatArray,
    axes: ByteArray,
    splits: FloatArray,
    levels: int,
    order: IntArray,
    rows: IntArray,
    places: FloatArray,
    first: int,
    last: int,
    gate: float,
    two: IntArray,
    searched_at: FloatArray,
    clear: FloatArray,
    found: IntArray,
) -> None:
    """Write the partners of the points ``rows[first:last]``; those that may have changed are searched."""
    stack, bounds = working_space()
    squared, near = np.empty(2), np.empty(2, dtype=np.intp)
    for i in range(first, last):
        row, place = rows[i], places[i]
        motion = np.sqrt(squared_distance(place, searched_at[row]))
        if two[row, 0] >= 0 and 2.0 * motion < clear[row, 1] - clear[row, 0]:
            found[i] = _within(points, order, place, two[row, 0], gate)
            continue
        if motion < clear[row, 0] - gate:
            found[i] = -1
            continue
        within = (BEYOND_GATE * gate) ** 2
        if two[row, 1] >= 0:
            first_old, second_old = points[two[row, 0]], points[two[row, 1]]
            farther = max(squared_distance(place, first_old), squared_distance(place, second_old))
            within = min(within, farther * (1.0 + 1e-12))
        for k in range(2):
            squared[k], near[k] = within, -1
        search(points, axes, splits, levels, place, squared, near, stack, bounds)
        for k in range(2):
            two[row, k], clear[row, k] = near[k], np.sqrt(squared[k])
        for k in range(3):
            searched_at[row, k] = place[k]
        found[i] = _within(points, order, place, near[0], gate)


@compiled
def _within(points: FloatArray, order: IntArray, place: FloatArray, partner: int, gate: float) -> int:
    """Return the row of a tree's point; -1 if there is no partner or it is beyond the gate."""
    if partner >= 0 and squared_distance(place, points[partner]) <= gate * gate:
        return order[partner]
    return -1


def _either(
    one: tuple[IntArray, IntArray], other: tuple[IntArray, IntArray], target_count: int
) -> tuple[IntArray, IntArray]:
    """Return the pairs that are in one list or both, once each, ordered by source row and then target row.

    Each pair is sorted as one number, which takes a tenth of the time of sorting rows.
    """
    keys = np.sort(np.concatenate([near * target_count + partners for near, partners in (one, other)]))
    near, partners = np.divmod(keys[np.diff(keys, prepend=-1) > 0], target_count)
    return near, partners


@compiled
def _paired(found: IntArray) -> tuple[IntArray, IntArray]:
    """Return the points that have a partner, and their partners."""
    near, count = np.empty((2, len(found)), dtype=np.intp), 0
    for i in range(len(found)):
        near[0, count], near[1, count] = i, found[i]
        count += found[i] >= 0
    return near[0, :count], near[1, :count]


@compiled
def _pairs(
    near: IntArray,
    partners: IntArray,
    moved: FloatArray,
    targets: FloatArray,
    source_rows: IntArray,
    target_rows: IntArray,
) -> tuple[IntArray, IntArray, FloatArray, FloatArray, FloatArray]:
    """Build the arrays of a ``Matching`` from the paired rows of two subsets."""
    count = len(near)
    rows = np.empty((2, count), dtype=np.intp)
    points = np.empty((2, count, 3))
    distances = np.empty(count)
    for m in range(count):
        i, j = near[m], partners[m]
        rows[0, m], rows[1, m] = source_rows[i], target_rows[j]
        for k in range(3):  # copying whole points takes four times as long
            points[0, m, k], points[1, m, k] = moved[i, k], targets[j, k]
        distances[m] = np.sqrt(squared_distance(moved[i], targets[j]))
    return rows[0], rows[1], points[0], points[1], distances


@compiled
def mean_normals(
    T: FloatArray, moving: FloatArray, fixed: FloatArray, source_rows: IntArray, target_rows: IntArray
) -> tuple[FloatArray, FloatArray]:
    """Return pairs' (M, 3) mean normals in the target frame, and the (M,) cosines between the two.

    The source's normal is turned by the pose's rotation, and flipped where the two point to opposite sides,
    so the cosines are 0 or more.
    """
    normals, cosines, turned = np.empty((len(source_rows), 3)), np.empty(len(source_rows)), np.empty(3)
    scale = np.sqrt(T[0, 0] * T[0, 0] + T[1, 0] * T[1, 0] + T[2, 0] * T[2, 0])
    for m in range(len(source_rows)):
        of_source, of_target, cosine = moving[source_rows[m]], fixed[target_rows[m]], 0.0
        for k in range(3):
            turned[k] = (T[k, 0] * of_source[0] + T[k, 1] * of_source[1] + T[k, 2] * of_source[2]) / scale
            cosine += turned[k] * of_target[k]
        sign = 1.0 if cosine >= 0.0 else -1.0
        cosines[m] = sign * cosine
        length = np.sqrt(2.0 + 2.0 * cosines[m])
        for k in range(3):
            normals[m, k] = (of_target[k] + sign * turned[k]) / length
    return normals, cosines


class _Cloud:
    """A cloud and those of its subsets that have been searched."""

    def __init__(self, points_m: FloatArray, features: FloatArray | None) -> None:
        self.points_m, self.features = points_m, features
        self._subsets: dict[int, _Subset] = {}

    def subset(self, share: float) -> _Subset:
        """Return a random share of the points, in their order; larger shares contain the smaller ones."""
        count = min(len(self.points_m), max(6, round(share * len(self.points_m))))
        if count not in self._subsets:
            whole = count == len(self.points_m)
            rows = np.arange(count) if whole else ascending(self._order[:count], len(self.points_m))
            self._subsets[count] = _Subset(self, rows)
        return self._subsets[count]

    @cached_property
    def _order(self) -> IntArray:
        return np.argsort(random_keys(self.points_m, 0))


def _normals_of(cloud: PointCloud, searched: _Cloud) -> Normals:
    return Normals(cloud.points_m, cloud.normals, lambda: searched.subset(1.0).tree)


def _stacked(points_m: FloatArray, features: FloatArray | None) -> FloatArray:
    return points_m if features is None else np.concatenate([points_m, features], axis=1)
