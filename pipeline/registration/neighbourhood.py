"""Point spacing and surface normals of a cloud, from the nearest neighbours of its points."""

from __future__ import annotations

import logging
from collections.abc import Callable
from functools import cached_property, partial

import numpy as np

from pipeline.kernels.kdtree import KdTree, compiled, tree_of
from pipeline.kernels.local_planes import patch_normals, shared_normals
from pipeline.kernels.point_sets import neighbour_distances_m
from pipeline.registration.sample import drawn_rows
from pipeline.types import BoolArray, FloatArray

_log = logging.getLogger(__name__)

NORMAL_NEIGHBOURS, SHARED_NEIGHBOURS, SPACING_NEIGHBOURS = 20, 40, 4
SHARING = 8
"""About how many points share a normal in a registration."""
FEW_POINTS = 5000
"""Clouds up to this size get a plane for each point: 40 neighbours would reach around corners."""
SPACING_SAMPLE = 4096
"""Number of points whose spacing gives the median."""
_UNIT_TOLERANCE = 1e-3
"""Given normals whose length differs more from 1 are scaled."""


class Normals:
    """Unit normals of a cloud's points, computed at first use.

    Computed normals point towards a camera at the origin; given ones keep their direction. In large clouds
    neighbours share a normal: that of the plane through the 40 points nearest to one in eight, drawn at
    random. A registration by them is as accurate as one by a plane for each point (SPEC 4.1).
    """

    def __init__(
        self, points_m: FloatArray, known: FloatArray | None = None, tree: Callable[[], KdTree] | None = None
    ) -> None:
        """Prepare for (N, 3) points; ``tree`` returns their tree.

        ``known`` are given normals, of any length; those that are zero or not finite are computed.
        """
        self._points_m, self._known, self._tree_of = points_m, known, tree or partial(tree_of, points_m)

    @cached_property
    def all(self) -> FloatArray:
        """(N, 3) unit normals."""
        return _completed(self._known, self._points_m, self._computed)

    def _computed(self) -> FloatArray:
        if len(self._points_m) <= FEW_POINTS:
            return patch_normals(self._tree_of(), NORMAL_NEIGHBOURS)
        rows = drawn_rows(self._points_m, -(-len(self._points_m) // SHARING))
        return shared_normals(self._tree_of(), SHARED_NEIGHBOURS, rows)


def _completed(known: FloatArray | None, points_m: FloatArray, found: Callable[[], FloatArray]) -> FloatArray:
    """Return (N, 3) given normals with unit length; those of ``found`` replace unusable or missing ones."""
    if known is None:
        return _facing(found(), points_m)
    usable, normals = _usable(known)
    if not usable.all():
        normals[~usable] = _facing(found(), points_m)[~usable]
    return normals


def _usable(normals: FloatArray) -> tuple[BoolArray, FloatArray]:
    """Return (N,) True for (N, 3) normals that are finite and not zero, and the normals with unit length."""
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
def _facing(normals: FloatArray, points: FloatArray) -> FloatArray:
    """Flip those (N, 3) normals that point away from the origin, in place; returns them."""
    for i in range(len(normals)):
        if normals[i, 0] * points[i, 0] + normals[i, 1] * points[i, 1] + normals[i, 2] * points[i, 2] > 0.0:
            for k in range(3):
                normals[i, k] = -normals[i, k]
    return normals


def facing_origin(normals: FloatArray, points_m: FloatArray) -> FloatArray:
    """Return (N, 3) normals of (N, 3) points, those flipped that point away from a camera at the origin."""
    return _facing(np.array(normals, np.float64, order="C"), np.ascontiguousarray(points_m, np.float64))


def pca_normals(
    points_m: FloatArray, known: FloatArray | None = None, tree: KdTree | None = None
) -> FloatArray:
    """Compute (N, 3) unit normals from each point's nearest 20, oriented towards a camera at the origin.

    Given normals keep their direction.

    Args:
        points_m: (N, 3) points.
        known: (N, 3) given normals, of any length; only those that are zero or not finite are computed.
        tree: tree of the points, if there is one.
    """
    return _completed(known, points_m, lambda: patch_normals(tree or tree_of(points_m), NORMAL_NEIGHBOURS))


def median_spacing_m(points_m: FloatArray) -> float:
    """Return the median distance of (N, 3) points, at most 4096 drawn ones, to their nearest other point."""
    tree = tree_of(points_m)
    some_m = points_m[drawn_rows(points_m, SPACING_SAMPLE)]
    return float(np.median(tree.nearest(some_m, min(2, len(tree)))[0][:, 1:]))


def local_spacing_m(points_m: FloatArray) -> FloatArray:
    """Return (N,) mean distance of each point to its nearest four others; zero for a single point."""
    if len(points_m) < 2:
        return np.zeros(len(points_m))
    return neighbour_distances_m(points_m, SPACING_NEIGHBOURS).mean(axis=1)
