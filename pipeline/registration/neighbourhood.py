"""Spacing and surface normals of a cloud, from the nearest neighbours of its points."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property, partial

import numpy as np

from pipeline.kdtree import KdTree, tree_of
from pipeline.patches import patch_normals
from pipeline.points import neighbour_distances_m
from pipeline.types import FloatArray, IntArray

NORMAL_NEIGHBOURS, SPACING_NEIGHBOURS = 20, 4


class Normals:
    """Unit normals of a cloud's points, each found when it is first asked for.

    They are those of the planes through each point's nearest 20, towards a camera at the origin.
    """

    def __init__(
        self, points_m: FloatArray, known: FloatArray | None = None, tree: Callable[[], KdTree] | None = None
    ) -> None:
        """Of (N, 3) points; ``known`` are their normals if they have some, ``tree`` gives their tree."""
        self._points_m, self._tree_of = points_m, tree or partial(tree_of, points_m)
        self._found = np.full(len(points_m), known is not None)
        given = np.empty((len(points_m), 3)) if known is None else known
        self._normals = np.ascontiguousarray(given, dtype=np.float64)

    def at(self, rows: IntArray) -> FloatArray:
        """(N, 3), of which those at the ``rows`` are found."""
        missing = np.zeros(len(self._found), dtype=bool)
        missing[rows] = True
        missing &= ~self._found
        if missing.any():
            places = np.flatnonzero(missing[self._tree.order])
            at = self._tree.order[places]
            normals = patch_normals(self._tree, NORMAL_NEIGHBOURS, places)
            away = np.einsum("ni,ni->n", normals, self._points_m[at]) > 0
            self._normals[at] = np.where(away[:, None], -normals, normals)
            self._found |= missing
        return self._normals

    @cached_property
    def _tree(self) -> KdTree:
        return self._tree_of()


def pca_normals(points_m: FloatArray) -> FloatArray:
    """(N, 3) unit normals of the planes through each point's nearest 20, towards a camera at the origin."""
    return Normals(points_m).at(np.arange(len(points_m)))


def median_spacing_m(points_m: FloatArray) -> float:
    """Median distance of (N, 3) points to their nearest other point."""
    return float(np.median(tree_of(points_m).nearest(points_m, min(2, len(points_m)))[0][:, 1:]))


def local_spacing_m(points_m: FloatArray) -> FloatArray:
    """(N,) mean distance of each point to its nearest four others; zero for a lone point."""
    if len(points_m) < 2:
        return np.zeros(len(points_m))
    return neighbour_distances_m(points_m, SPACING_NEIGHBOURS).mean(axis=1)
