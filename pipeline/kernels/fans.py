"""Renumbering of a mesh by a walk over it, so that neighbouring vertices and triangles get near numbers."""

from __future__ import annotations

import numba
import numpy as np

from pipeline.types import IntArray


def walked(triangles: IntArray, vertices: int) -> tuple[IntArray, IntArray]:
    """Number the vertices of a mesh as a walk meets them, breadth first.

    The walk takes vertex after vertex and goes once around each, triangle by triangle, where it can.

    Args:
        triangles: (F, 3) vertex indices.
        vertices: number of vertices V.

    Returns:
        (V,) the vertices in their new order, and (F, 3) the triangles by the new numbers in the order of the
        walk, each turned so that the vertex around which the walk went is first.
    """
    order, faces = _walk(np.ascontiguousarray(triangles, np.int64).reshape(-1, 3), vertices)
    return order, faces


@numba.njit(cache=True, nogil=True)
def _walk(triangles, vertices):  # type: ignore[no-untyped-def]
    begins, around = _incident(triangles, vertices)
    number, order = np.full(vertices, -1), np.empty(vertices, np.int64)
    done, faces = np.zeros(len(triangles), np.bool_), np.empty_like(triangles)
    found, met, written = 0, 0, 0
    for seed in range(vertices):
        if number[seed] < 0:
            number[seed], order[met] = met, seed
            met += 1
        while found < met:
            a = order[found]
            found += 1
            row = _start(triangles, around[begins[a] : begins[a + 1]], done, a, number)
            while row >= 0:
                done[row] = True
                b, c = _others(triangles[row], a)
                for one in (b, c):
                    if number[one] < 0:
                        number[one], order[met] = met, one
                        met += 1
                faces[written] = number[a], number[b], number[c]
                written += 1
                row = _next(triangles, around[begins[a] : begins[a + 1]], done, a, c)
                if row < 0:
                    row = _start(triangles, around[begins[a] : begins[a + 1]], done, a, number)
    return order, faces


@numba.njit(cache=True, nogil=True)
def _incident(triangles, vertices):  # type: ignore[no-untyped-def]
    """Return (V + 1,) begins and the rows of the triangles around each vertex."""
    begins = np.zeros(vertices + 1, np.int64)
    for corners in triangles:
        for one in corners:
            begins[one + 1] += 1
    begins = np.cumsum(begins)
    around, filled = np.empty(begins[-1], np.int64), begins[:-1].copy()
    for row in range(len(triangles)):
        for one in triangles[row]:
            around[filled[one]] = row
            filled[one] += 1
    return begins, around


@numba.njit(cache=True, nogil=True)
def _others(corners, a):  # type: ignore[no-untyped-def]
    """Return the two corners after ``a``."""
    if corners[0] == a:
        return corners[1], corners[2]
    if corners[1] == a:
        return corners[2], corners[0]
    return corners[0], corners[1]


@numba.njit(cache=True, nogil=True)
def _next(triangles, around, done, a, edge):  # type: ignore[no-untyped-def]
    """Return the triangle around ``a`` that follows behind the edge to ``edge``; -1 without one."""
    for row in around:
        if not done[row] and _others(triangles[row], a)[0] == edge:
            return row
    return -1


@numba.njit(cache=True, nogil=True)
def _start(triangles, around, done, a, number):  # type: ignore[no-untyped-def]
    """Return the triangle at which to begin around ``a``; -1 if all are done.

    Best is one that follows no other, and of those the one whose second corner was met first.
    """
    best, best_follows, best_number = -1, True, 0
    for row in around:
        if done[row]:
            continue
        b = _others(triangles[row], a)[0]
        met = number[b] if number[b] >= 0 else len(number)
        follows = False
        for other in around:
            if not done[other] and other != row and _others(triangles[other], a)[1] == b:
                follows = True
        if best < 0 or follows < best_follows or (follows == best_follows and met < best_number):
            best, best_follows, best_number = row, follows, met
    return best
