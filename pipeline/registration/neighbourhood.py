"""Spacing and surface normals of a cloud, from the nearest neighbours of its points."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property, partial

import numpy as np

from pipeline.kernels.kdtree import KdTree, compiled, tree_of
from pipeline.kernels.local_planes import patch_normals
from pipeline.kernels.point_sets import neighbour_distances_m
from pipeline.types import BoolArray, FloatArray, IntArray

NORMAL_NEIGHBOURS, SPACING_NEIGHBOURS = 20, 4
FEW_POINTS = 20_000
"""The normals of so few are all found at once, on all cores, rather than some at every iteration."""


class Normals:
    """Unit normals of a cloud's points, found when they are first asked for: of many points, only those.

    They are those of the planes through each point's nearest 20, towards a camera at the origin.
    """

    def __init__(
        self, points_m: FloatArray, known: FloatArray | None = None, tree: Callable[[], KdTree] | None = None
    ) -> None:
        """Of (N, 3) points; ``known`` are their normals if they have some, ``tree`` gives their tree."""
        self._points_m, self._tree_of = points_m, tree or partial(tree_of, points_m)
        self._found, self._all = np.full(len(points_m), known is not None), known is not None
        given = np.empty((len(points_m), 3)) if known is None else known
        self._normals = np.ascontiguousarray(given, dtype=np.float64)

    def at(self, rows: IntArray) -> FloatArray:
        """(N, 3), of which those at the ``rows`` are found."""
        if self._all:
            return self._normals
        if len(self._found) <= FEW_POINTS:
            rows, self._all = np.arange(len(self._found)), True
        missing = _enter(rows, self._found)
        if len(missing):
            places = np.sort(self._places[missing])
            found = patch_normals(self._tree, NORMAL_NEIGHBOURS, places)
            _enter_facing(found, self._tree.order[places], self._points_m, self._normals)
        return self._normals

    @cached_property
    def _places(self) -> IntArray:
        """(N,) of the points in their tree."""
        places = np.empty_like(self._tree.order)
        places[self._tree.order] = np.arange(len(places))
        return places

    @cached_property
    def _tree(self) -> KdTree:
        return self._tree_of()


@compiled
def _enter(rows: IntArray, entered: BoolArray) -> IntArray:
    """Those of the ``rows`` that had not been entered, each once; now they have."""
    new, count = np.empty_like(rows), 0
    for row in rows:
        new[count] = row
        count += not entered[row]
        entered[row] = True
    return new[:count]


@compiled
def _enter_facing(found: FloatArray, rows: IntArray, points: FloatArray, normals: FloatArray) -> None:
    """Write what was found into the ``rows`` of the normals, turned towards the origin."""
    for i in range(len(rows)):
        row, along = rows[i], 0.0
        for k in range(3):
            along += found[i, k] * points[row, k]
        for k in range(3):
            normals[row, k] = -found[i, k] if along > 0.0 else found[i, k]


def pca_normals(points_m: FloatArray) -> FloatArray:
    """(N, 3) unit normals of the planes through each point's nearest 20, towards a camera at the origin."""
    return Normals(points_m).at(np.arange(len(points_m)))


def median_spacing_m(points_m: FloatArray) -> float:
    """Median distance of (N, 3) points to their nearest other point."""
    tree = tree_of(points_m)
    return float(np.median(tree.nearest(tree.points_m, min(2, len(tree)))[0][:, 1:]))


def local_spacing_m(points_m: FloatArray) -> FloatArray:
    """(N,) mean distance of each point to its nearest four others; zero for a lone point."""
    if len(points_m) < 2:
        return np.zeros(len(points_m))
    return neighbour_distances_m(points_m, SPACING_NEIGHBOURS).mean(axis=1)
