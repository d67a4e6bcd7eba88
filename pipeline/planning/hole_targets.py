"""Targets in one hole of a surface: what a camera would have to measure there."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.spatial import cKDTree

from pipeline.planning.targets import Targets, sensed
from pipeline.planning.views import PresentView
from pipeline.surface.fill import skin_points_m
from pipeline.surface.holes import Hole, beyond_m
from pipeline.types import FloatArray, Surface

SAMPLES = 200
"""Number of points drawn in a hole, or most edges of a rim that are used."""


def hole_targets(surface: Surface, hole: Hole, views: Sequence[PresentView], reach_m: float) -> Targets:
    """Return points of a hole as targets, each an equal share of the hole.

    They are drawn by area from the triangulation of least area over the loop, with the normal of the surface
    at the nearest corner of the loop. Of a rim, which encloses nothing, they are just outside its edges, in
    the planes of their triangles.

    Args:
        surface: the surface.
        hole: one of its boundary loops.
        views: what the present cameras see, which tells whether the place is dark.
        reach_m: distance of a rim's points from its edges, metres.
    """
    corners_m = surface.vertices_m[hole.loop]
    if hole.open:
        points_m = skin_points_m(corners_m, SAMPLES)
    else:
        edges = np.stack([hole.loop, np.roll(hole.loop, -1)], axis=1)
        edges = edges[np.unique(np.linspace(0, len(edges) - 1, SAMPLES).astype(int))]
        points_m = beyond_m(surface.vertices_m, surface.triangles, edges, reach_m)
    normals = _normals(surface)[hole.loop][cKDTree(corners_m).query(points_m)[1]]
    count = len(points_m)
    return Targets(points_m, normals, np.zeros(count, int), *sensed(points_m, views), 1.0 / count)


def _normals(surface: Surface) -> FloatArray:
    """Return (V, 3) unit normals of the vertices: of the sum of their triangles' area vectors."""
    a, b, c = surface.vertices_m[surface.triangles].swapaxes(0, 1)
    areas = np.cross(b - a, c - a)
    sums = np.stack(
        [
            np.bincount(surface.triangles.ravel(), np.repeat(part, 3), len(surface.vertices_m))
            for part in areas.T
        ],
        axis=1,
    )
    return sums / np.maximum(np.linalg.norm(sums, axis=1, keepdims=True), 1e-300)
