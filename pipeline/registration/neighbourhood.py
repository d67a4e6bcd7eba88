"""Point spacing and surface normals of a cloud, from the nearest neighbours of its points."""

from __future__ import annotations

import logging
from collections.abc import Callable
from functools import cached_property, partial

import numpy as np

from pipeline.kernels.kdtree import KdTree, compiled, tree_of
from pipeline.kernels.local_planes import patch_normals
from pipeline.kernels.point_sets import ascending, neighbour_distances_m
from pipeline.types import BoolArray, FloatArray, IntArray

_log = logging.getLogger(__name__)

NORMAL_NEIGHBOURS, SPACING_NEIGHBOURS = 20, 4
_UNIT_TOLERANCE = 1e-3
"""Given normals whose length differs more from 1 are scaled."""
FEW_POINTS = 20_000
"""Clouds up to this size get all their normals at once, on all cores, instead of some at each iteration."""


class Normals:
    """Unit normals of a cloud's points, computed at first use; in large clouds only for the used points.

    Each is the normal of the plane through the point's nearest 20, oriented towards a camera at the origin.
    """

    def __init__(
        self, points_m: FloatArray, known: FloatArray | None = None, tree: Callable[[], KdTree] | None = None
    ) -> None:
        """Prepare for (N, 3) points; ``tree`` returns their tree.

        ``known`` are given normals, of any length; those that are zero or not finite are computed.
        """
        self._points_m, self._tree_of = points_m, tree or partial(tree_of, points_m)
        unknown = np.zeros(len(points_m), bool), np.empty((len(points_m), 3))
        found, normals = unknown if known is None else _usable(known)
        self._found: BoolArray = found
        self._normals: FloatArray = normals
        self._all = bool(self._found.all())

    def at(self, rows: IntArray) -> FloatArray:
        """Return (N, 3) normals, of which at least those at ``rows`` are valid."""
        if self._all:
            return self._normals
        if len(self._found) <= FEW_POINTS:
            rows, self._all = np.arange(len(self._found)), True
        missing = _enter(rows, self._found)
        if len(missing):
            places = ascending(self._places[missing], len(self._found))
            found = patch_normals(self._tree, NORMAL_NEIGHBOURS, places)
            _enter_facing(found, self._tree.order[places], self._points_m, self._normals)
        return self._normals

    @cached_property
    def _places(self) -> IntArray:
        """(N,) position of each point in the tree's order."""
        places = np.empty_like(self._tree.order)
        places[self._tree.order] = np.arange(len(places))
        return places

    @cached_property
    def _tree(self) -> KdTree:
        return self._tree_of()


def _usable(normals: FloatArray) -> tuple[BoolArray, FloatArray]:
    """Return (N,) which of (N, 3) normals are finite and not zero, and the normals with unit length."""
    normals = np.array(normals, dtype=np.float64, order="C")
    lengths = np.linalg.norm(normals, axis=1)
    usable = np.isfinite(lengths) & (lengths > 0.0)
    if not usable.all():
        _log.warning(
            "%d of %d normals are zero or not finite; they are estimated from the points",
            (~usable).sum(),
            len(usable),
        )
    scaled = usable & (np.abs(lengths - 1.0) > _UNIT_TOLERANCE)
    normals[scaled] /= lengths[scaled, None]
    return usable, normals


@compiled
def _enter(rows: IntArray, entered: BoolArray) -> IntArray:
    """Mark ``rows`` as entered; returns, once each, those that were not entered before."""
    new, count = np.empty_like(rows), 0
    for row in rows:
        new[count] = row
        count += not entered[row]
        entered[row] = True
    return new[:count]


@compiled
def _enter_facing(found: FloatArray, rows: IntArray, points: FloatArray, normals: FloatArray) -> None:
    """Write the found normals into ``rows`` of ``normals``, oriented towards the origin."""
    for i in range(len(rows)):
        row, along = rows[i], 0.0
        for k in range(3):
            along += found[i, k] * points[row, k]
        for k in range(3):
            normals[row, k] = -found[i, k] if along > 0.0 else found[i, k]


def pca_normals(points_m: FloatArray) -> FloatArray:
    """Compute (N, 3) unit normals from each point's nearest 20, oriented towards a camera at the origin."""
    return Normals(points_m).at(np.arange(len(points_m)))


def median_spacing_m(points_m: FloatArray) -> float:
    """Return the median distance of (N, 3) points to their nearest other point."""
    tree = tree_of(points_m)
    return float(np.median(tree.nearest(tree.points_m, min(2, len(tree)))[0][:, 1:]))


def local_spacing_m(points_m: FloatArray) -> FloatArray:
    """Return (N,) mean distance of each point to its nearest four others; zero for a single point."""
    if len(points_m) < 2:
        return np.zeros(len(points_m))
    return neighbour_distances_m(points_m, SPACING_NEIGHBOURS).mean(axis=1)
