"""Classification of a mesh's boundary loops: holes, rims around its components, and islands."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pipeline.kernels.ordering import stable_order
from pipeline.surface.boundary import (
    LONGEST_HOLE_M,
    boundary_loops,
    connected_parts,
    directed_edges,
    edges_and_faces,
    loop_areas_m2,
    loop_edges,
    loop_measures,
)
from pipeline.types import BoolArray, FloatArray, IntArray


@dataclass(frozen=True, slots=True)
class Hole:
    """One closed loop of edges with one face each."""

    loop: IntArray
    """(L,) vertex indices, the first not repeated; a hole's are clockwise seen from outside."""
    length_m: float
    area_m2: float
    """Length of the loop's area vector (``loop_measures``): its area if it is flat."""
    center_m: FloatArray
    """(3,) mean of the loop's edges, weighted by their length."""
    rim: bool
    """True where the surface ends: the longest loop of a connected component, or one of 1 m or more."""
    island: bool = False
    """True for any other loop that runs around a piece of surface which is attached to its component at a
    single point: there is nothing to close inside it."""

    @property
    def open(self) -> bool:
        """Whether the loop is a hole in the surface: neither rim nor island."""
        return not (self.rim or self.island)


def find_holes(
    vertices_m: FloatArray, triangles: IntArray, parts: IntArray | None = None
) -> tuple[Hole, ...]:
    """Find all boundary loops of a mesh: holes, largest first, then rims and islands, longest first.

    The areas of those that are ``open`` add up to ``open_area_m2``.

    Args:
        vertices_m: (V, 3) vertices.
        triangles: (F, 3) vertex indices.
        parts: (V,) label of each vertex's connected component; computed if None.
    """
    loops = boundary_loops(triangles)
    if not loops:
        return ()
    lengths_m, areas_m2 = loop_measures(vertices_m, loops)
    if parts is None:
        parts = connected_parts(edges_and_faces(triangles)[0], len(vertices_m))
    rims = _rims(lengths_m, parts[[loop[0] for loop in loops]])
    edges, first = loop_edges(loops)
    islands = _run_around(vertices_m, triangles, edges, first) & ~rims
    centers_m = _centers_m(vertices_m[edges], first)
    ends = rims | islands
    order = np.lexsort((np.where(ends, -lengths_m, -areas_m2), ends))
    return tuple(
        Hole(
            loops[index],
            float(lengths_m[index]),
            float(areas_m2[index]),
            centers_m[index],
            bool(rims[index]),
            bool(islands[index]),
        )
        for index in order
    )


def open_area_m2(vertices_m: FloatArray, triangles: IntArray, parts: IntArray | None = None) -> float:
    """Return the area of all holes of a mesh, without rims and islands; arguments as for ``find_holes``."""
    return sum((hole.area_m2 for hole in find_holes(vertices_m, triangles, parts) if hole.open), 0.0)


def _rims(lengths_m: FloatArray, part: IntArray) -> BoolArray:
    """Return (L,) True for rims: the longest loop of each component, and loops of 1 m or more."""
    order = np.lexsort((lengths_m, part))
    rims = lengths_m >= LONGEST_HOLE_M
    rims[order[np.append(part[order][1:] != part[order][:-1], True)]] = True
    return rims


def _run_around(vertices_m: FloatArray, triangles: IntArray, edges: IntArray, first: IntArray) -> BoolArray:
    """Return (L,) True for loops that run anticlockwise about the mean normal of their triangles."""
    enclosed = loop_areas_m2(vertices_m[edges[:, 0]], vertices_m[edges[:, 1]], first)
    face = half_edges(triangles, edges) // 3
    a, b, c = vertices_m[triangles[face]].swapaxes(0, 1)
    normals = np.cross(b - a, c - a) * (face >= 0)[:, None]
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-300)
    return np.sum(enclosed * np.add.reduceat(normals, first, axis=0), axis=1) > 0.0


def half_edges(triangles: IntArray, edges: IntArray) -> IntArray:
    """Find (E,) half-edge numbers of directed edges: 3 t + k is from corner k of triangle t to the next.

    Args:
        triangles: (F, 3) vertex indices.
        edges: (E, 2) vertex indices.

    Returns:
        -1 for an edge that no triangle has in this direction.
    """
    if not len(triangles):
        return np.full(len(edges), -1)
    count = int(max(triangles.max(), edges.max(initial=0))) + 1
    start, end = directed_edges(triangles).T
    keys = start * count + end
    edge_keys = edges.astype(np.int64) @ [count, 1]
    order = stable_order(keys)
    found = order[np.minimum(np.searchsorted(keys, edge_keys, sorter=order), len(order) - 1)]
    return np.where(keys[found] == edge_keys, found, -1)


def is_closed(triangles: IntArray, added: BoolArray, loop: IntArray) -> bool:
    """Return whether new triangles have closed a loop completely.

    Every edge of the loop must have its second triangle, and those edge-connected patches of new
    triangles that touch the loop must have no edge with one face.

    Args:
        triangles: (F, 3) triangles of the mesh, including the new ones.
        added: (F,) True for the new triangles.
        loop: (L, 2) edges, directed as in the old triangles along them.
    """
    back = half_edges(triangles, loop[:, ::-1])
    if np.any(back < 0):
        return False
    reverse = np.stack([np.roll(triangles, -1, axis=1).ravel(), triangles.ravel()], axis=1)
    twin = half_edges(triangles, reverse) // 3
    face = np.arange(len(twin)) // 3
    joined = (twin >= 0) & added[face] & added[twin]
    patch = connected_parts(np.stack([face[joined], twin[joined]], axis=1), len(added))
    at_loop = np.unique(patch[back // 3][added[back // 3]])
    return not np.any((twin < 0) & added[face] & np.isin(patch[face], at_loop))


def beyond_m(vertices_m: FloatArray, triangles: IntArray, edges: IntArray, distance_m: float) -> FloatArray:
    """Return (E, 3) points at a distance from directed edges, in their triangles' planes but outside them."""
    half = half_edges(triangles, edges)
    opposite_m = vertices_m[triangles[half // 3, (half % 3 + 2) % 3]]
    a, b = vertices_m[edges].swapaxes(0, 1)
    along = (b - a) / np.maximum(np.linalg.norm(b - a, axis=1, keepdims=True), 1e-12)
    out = a - opposite_m
    out -= np.sum(out * along, axis=1, keepdims=True) * along
    out /= np.maximum(np.linalg.norm(out, axis=1, keepdims=True), 1e-12)
    return 0.5 * (a + b) + distance_m * out


def _centers_m(ends_m: FloatArray, first: IntArray) -> FloatArray:
    """Return (L, 3) means of the loops' (E, 2, 3) edges, weighted by their length."""
    weights = np.maximum(np.linalg.norm(ends_m[:, 1] - ends_m[:, 0], axis=1), 1e-12)
    sums = np.add.reduceat(ends_m.mean(axis=1) * weights[:, None], first, axis=0)
    return sums / np.add.reduceat(weights, first)[:, None]
