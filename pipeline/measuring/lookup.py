"""Places on a surface: the nearest to a point, the first on a ray, the neighbours of a vertex."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from weakref import WeakKeyDictionary

import numpy as np

from pipeline.kernels.kdtree import KdTree
from pipeline.kernels.open3d_runtime import o3d
from pipeline.kernels.rays import tensor, triangle_scene
from pipeline.measuring.flood import flooded
from pipeline.measuring.surface import MeasuredSurface
from pipeline.surface.boundary import edges_and_faces
from pipeline.surface.holes import Hole, find_holes
from pipeline.surface.radii import spacing
from pipeline.types import BoolArray, FloatArray, IntArray

NEIGHBOURS = 8
"""Neighbours of a point of a cloud, which has no edges."""
BESIDE_RAY = 1.5
"""A ray meets a point of a cloud that is within this many spacings of it."""


@dataclass(frozen=True, slots=True)
class Spot:
    """A place on a surface."""

    point_m: FloatArray
    """(3,)."""
    corners: IntArray
    """(3,) vertices of its triangle; (1,) the point of a cloud."""
    shares: FloatArray
    """(3,) or (1,) barycentric coordinates, which add up to 1."""


class Lookup:
    """The searchable form of a surface."""

    def __init__(self, vertices_m: FloatArray, triangles: IntArray) -> None:
        self._vertices_m, self._triangles = vertices_m, triangles

    @cached_property
    def spacing_m(self) -> float:
        """Mean distance of the nearest vertices."""
        return spacing(self._vertices_m)[0]

    @cached_property
    def edges(self) -> IntArray:
        """(E, 2) pairs of neighbouring vertices; of a cloud, the ``NEIGHBOURS`` nearest points."""
        return self._edges_and_faces[0]

    @cached_property
    def neighbours(self) -> tuple[IntArray, IntArray]:
        """(V + 1,) first place of each vertex's neighbours in a list of all, and this (2 E,) list."""
        ends = np.concatenate([self.edges, self.edges[:, ::-1]])
        counts = np.bincount(ends[:, 0], minlength=len(self._vertices_m))
        first = np.concatenate([[0], np.cumsum(counts)])
        return first, ends[np.argsort(ends[:, 0], kind="stable"), 1]

    @cached_property
    def open_holes(self) -> tuple[Hole, ...]:
        """Holes of the surface, the largest first."""
        return tuple(hole for hole in find_holes(self._vertices_m, self._triangles) if hole.open)

    def prepare(self) -> None:
        """Compute in advance what clicks on the surface need, so that the first click need not wait."""
        self.nearest(self._vertices_m[0])
        flooded(*self.neighbours, self.rim, 0)
        self.tree.nearest(self._vertices_m[:1], 1)
        _ = self.spacing_m

    @cached_property
    def rim(self) -> BoolArray:
        """(V,) True for vertices at an edge with one face."""
        edges, faces = self._edges_and_faces
        rim = np.zeros(len(self._vertices_m), bool)
        if len(self._triangles):
            rim[edges[faces == 1].ravel()] = True
        return rim

    @cached_property
    def _edges_and_faces(self) -> tuple[IntArray, IntArray]:
        if len(self._triangles):
            return edges_and_faces(self._triangles)
        count = min(NEIGHBOURS + 1, len(self._vertices_m))
        near = self.tree.nearest(self._vertices_m, count)[1][:, 1:]
        own = np.repeat(np.arange(len(near)), near.shape[1])
        edges = np.unique(np.sort(np.stack([own, near.ravel()], axis=1), axis=1), axis=0)
        return edges, np.full(len(edges), 2)

    @cached_property
    def tree(self) -> KdTree:
        """Tree of the vertices."""
        return KdTree(self._vertices_m)

    @cached_property
    def _scene(self) -> o3d.t.geometry.RaycastingScene:
        return triangle_scene(self._vertices_m, self._triangles)

    def nearest(self, point_m: FloatArray) -> Spot:
        """Return the place nearest to a (3,) point."""
        if not len(self._triangles):
            row = self.tree.nearest(np.asarray(point_m, float)[None], 1)[1][0]
            return Spot(self._vertices_m[row[0]], row, np.ones(1))
        found = self._scene.compute_closest_points(tensor(np.asarray(point_m)[None], np.float32))
        corners = self._triangles[int(found["primitive_ids"].numpy()[0])]
        return self._spot(corners, found["primitive_uvs"].numpy()[0])

    def first_on(self, origin_m: FloatArray, direction: FloatArray) -> Spot | None:
        """Return the first place on a ray; None if it misses."""
        if len(self._triangles):
            ray = np.concatenate([origin_m, direction])[None]
            hit = self._scene.cast_rays(tensor(ray, np.float32))
            if not np.isfinite(hit["t_hit"].numpy()[0]):
                return None
            corners = self._triangles[int(hit["primitive_ids"].numpy()[0])]
            return self._spot(corners, hit["primitive_uvs"].numpy()[0])
        along = np.asarray(direction, float) / np.linalg.norm(direction)
        away_m = self._vertices_m - origin_m
        ahead_m = away_m @ along
        beside_m = np.linalg.norm(away_m - ahead_m[:, None] * along, axis=1)
        met = np.flatnonzero((ahead_m > 0.0) & (beside_m <= BESIDE_RAY * self.spacing_m))
        if not len(met):
            return None
        row = met[[np.argmin(ahead_m[met])]]
        return Spot(self._vertices_m[row[0]], row, np.ones(1))

    def _spot(self, corners: IntArray, uv: FloatArray) -> Spot:
        shares = np.array([1.0 - uv.sum(), *uv], float)
        return Spot(shares @ self._vertices_m[corners], corners, shares)


_lookups: WeakKeyDictionary[MeasuredSurface, Lookup] = WeakKeyDictionary()


def lookup_of(surface: MeasuredSurface) -> Lookup:
    """Return the searchable form of a surface, which is made once."""
    if surface not in _lookups:
        _lookups[surface] = Lookup(surface.vertices_m, surface.triangles)
    return _lookups[surface]
