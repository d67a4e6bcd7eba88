"""Boundary of a mesh: edges with one face, and the closed loops that they form."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from pipeline.kernels.ordering import stable_order
from pipeline.types import BoolArray, FloatArray, IntArray

LONGEST_HOLE_M = 1.0
"""A boundary loop of at least this length is a rim of the scene, not a hole (SPEC 5)."""


def directed_edges(triangles: IntArray) -> IntArray:
    """Return (3 F, 2) edges of (F, 3) triangles: row 3 t + k is from corner k of triangle t to the next."""
    return triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2).astype(np.int64)


def edges_and_faces(triangles: IntArray) -> tuple[IntArray, IntArray]:
    """Return (E, 2) undirected edges, smaller index first, and (E,) number of faces at each."""
    directed = directed_edges(triangles)
    order, begins = _by_edge(directed)
    first = np.flatnonzero(begins)
    start, end = directed[order[first]].T
    edges = np.stack([np.minimum(start, end), np.maximum(start, end)], axis=1)
    return edges, np.diff(first, append=len(order))


def edges_with_one_face(triangles: IntArray) -> IntArray:
    """Return (B,) ascending rows of ``directed_edges`` whose edge has exactly one face."""
    order, begins = _by_edge(directed_edges(triangles))
    rows: IntArray = np.sort(order[begins & np.append(begins[1:], True)[: len(begins)]])
    return rows


def boundary_loops(triangles: IntArray) -> list[IntArray]:
    """Return the boundary of a mesh as closed loops of vertex indices, the first vertex not repeated.

    Each edge with exactly one face is used once, in the direction that it has in its face (a hole's
    loop is clockwise seen from outside). Loops that touch at a vertex are separated there, so no loop
    visits a vertex twice.
    """
    following = _boundary_successors(triangles)
    loops = []
    for start in sorted(following):
        while following[start]:
            loops.extend(_walk(start, following))
    return loops


def connected_parts(edges: IntArray, vertices: int) -> IntArray:
    """Return (vertices,) label of each vertex's connected component, from (E, 2) edges."""
    graph = coo_matrix((np.ones(len(edges)), (edges[:, 0], edges[:, 1])), (vertices, vertices))
    return connected_components(graph, directed=False)[1]


def loop_edges(loops: Sequence[IntArray]) -> tuple[IntArray, IntArray]:
    """Return (E, 2) directed edges of all closed loops, loop by loop, and (L,) first row of each loop."""
    sizes = np.array([len(loop) for loop in loops])
    first = np.cumsum(sizes) - sizes
    starts = np.concatenate(loops)
    following = np.arange(len(starts)) + 1
    following[first + sizes - 1] = first
    return np.stack([starts, starts[following]], axis=1), first


def loop_measures(vertices_m: FloatArray, loops: Sequence[IntArray]) -> tuple[FloatArray, FloatArray]:
    """Return (L,) lengths in m and (L,) areas in square metres of closed loops.

    The area is the vector sum of the fan of triangles from a loop's first vertex, which is exact for
    flat loops, also if they are not convex.
    """
    edges, first = loop_edges(loops)
    start_m, end_m = vertices_m[edges].swapaxes(0, 1)
    lengths_m = np.add.reduceat(np.linalg.norm(end_m - start_m, axis=1), first)
    return lengths_m, np.linalg.norm(loop_areas_m2(start_m, end_m, first), axis=1)


def loop_areas_m2(start_m: FloatArray, end_m: FloatArray, first: IntArray) -> FloatArray:
    """Return (L, 3) area vectors of loops, from their edges' ends (E, 3) and (L,) first edge of each loop."""
    apex_m = np.repeat(start_m[first], np.diff(first, append=len(start_m)), axis=0)
    return 0.5 * np.add.reduceat(np.cross(start_m - apex_m, end_m - apex_m), first, axis=0)


def _boundary_successors(triangles: IntArray) -> dict[int, list[int]]:
    """Return, for each boundary vertex, the vertices to which its directed boundary edges lead."""
    directed = directed_edges(triangles)
    following: dict[int, list[int]] = {}
    for start, end in directed[edges_with_one_face(triangles)].tolist():
        following.setdefault(start, []).append(end)
        following.setdefault(end, [])
    return following


def _by_edge(directed: IntArray) -> tuple[IntArray, BoolArray]:
    """Return (N,) an order of (N, 2) directed edges in which both directions of each edge are adjacent, and
    (N,) True, in that order, where another edge begins.
    """
    lower, upper = np.minimum(*directed.T), np.maximum(*directed.T)
    keys = lower * (upper.max(initial=0) + 1) + upper
    order = stable_order(keys)
    return order, np.append(True, np.diff(keys[order]) != 0)[: len(order)]


def _walk(start: int, following: dict[int, list[int]]) -> list[IntArray]:
    """Remove the edges of one trail from ``start`` and return it, split into simple loops.

    A trail stops without closing only where faces disagree in their orientation; its remaining
    vertices then count as one loop.
    """
    loops = []
    trail = [start]
    place = {start: 0}
    while following[trail[-1]]:
        vertex = following[trail[-1]].pop()
        if vertex in place:
            loops.append(np.array(trail[place[vertex] :]))
            for passed in trail[place[vertex] + 1 :]:
                del place[passed]
            del trail[place[vertex] + 1 :]
        else:
            place[vertex] = len(trail)
            trail.append(vertex)
    return loops if len(trail) == 1 else [*loops, np.array(trail)]
