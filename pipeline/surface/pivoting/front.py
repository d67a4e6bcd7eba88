"""The growing mesh and its front, stored as half-edges in arrays.

Half-edge 3 t + k leads from corner k of triangle t to its next corner. The front consists of the
half-edges without a twin. To glue two half-edges, their twins are set; the four cases of Bernardini et
al. 1999 (a loop of two is closed, a loop is shortened or split, two are merged) need no extra code.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pipeline.surface.pivoting.compiled import compiled
from pipeline.types import ByteArray, FloatArray, IntArray

FACES, HEAD, TAIL, CURSOR, SETTLED = range(5)
"""Indices in ``Front.counts``: triangles; head and tail of the queue; next seed; points used or given up."""


class Front(NamedTuple):
    """State of the algorithm; arrays of length F have room for more triangles."""

    triangles: IntArray
    """(F, 3) int32, anticlockwise from the outside."""
    centers_m: FloatArray
    """(F, 3) centre of the ball that made each triangle."""
    pivots_m: FloatArray
    """(F, 3) centre of the ball of the current radius on each triangle."""
    radius_index: ByteArray
    """(F,) index of the radius that made each triangle."""
    twin: IntArray
    """(3 F,) opposite half-edge, -1 on the front."""
    end: IntArray
    """(3 F,) end point of each half-edge."""
    following: IntArray
    """(3 F,) next half-edge that starts at the same point, -1 for none."""
    outgoing: IntArray
    """(N,) first half-edge from each point, -1 for an unused point."""
    open_count: IntArray
    """(N,) number of half-edges from each point that are on the front."""
    given_up: ByteArray
    """(N,) 1 where no ball of the current radius makes a seed."""
    queue: IntArray
    """(3 F,) half-edges to pivot about."""
    counts: IntArray
    """(5,) counters, indexed by ``FACES`` to ``SETTLED``."""


def new_front(n_points: int) -> Front:
    """Create a front without triangles."""
    room = 2 * n_points + 64
    return Front(
        triangles=np.empty((room, 3), np.int32),
        centers_m=np.empty((room, 3)),
        pivots_m=np.empty((room, 3)),
        radius_index=np.empty(room, np.uint8),
        twin=np.empty(3 * room, np.int32),
        end=np.empty(3 * room, np.int32),
        following=np.empty(3 * room, np.int32),
        outgoing=np.full(n_points, -1, np.int32),
        open_count=np.zeros(n_points, np.int32),
        given_up=np.zeros(n_points, np.uint8),
        queue=np.empty(3 * room, np.int32),
        counts=np.zeros(5, np.int64),
    )


def grown(front: Front) -> Front:
    """Return the same front with 50 % more room for triangles."""
    per_point = ("outgoing", "open_count", "given_up", "counts")
    longer = {
        name: np.concatenate([array, np.empty_like(array[: len(array) // 2 + 1])])
        for name, array in front._asdict().items()
        if name not in per_point
    }
    room = len(longer["triangles"])
    longer |= {name: longer[name][: 3 * room] for name in ("twin", "end", "following", "queue")}
    return front._replace(**longer)


@compiled
def find(front, a, b):  # type: ignore[no-untyped-def]
    """Return the half-edge from a to b, -1 for none."""
    edge = front.outgoing[a]
    while edge >= 0 and front.end[edge] != b:
        edge = front.following[edge]
    return edge


@compiled
def can_join(front, a, x, b):  # type: ignore[no-untyped-def]
    """Return whether half-edges a to x and x to b may be added: x is not interior, both edges are free."""
    if front.outgoing[x] < 0:
        return True
    return front.open_count[x] > 0 and find(front, a, x) < 0 and find(front, x, b) < 0


@compiled
def add_triangle(front, a, b, c, x, y, z, radius_index):  # type: ignore[no-untyped-def]
    """Add a triangle with its ball's centre, glue its edges to the front, and queue its new front edges."""
    t = front.counts[FACES]
    front.counts[FACES] += 1
    front.triangles[t, 0], front.triangles[t, 1], front.triangles[t, 2] = a, b, c
    front.centers_m[t, 0], front.centers_m[t, 1], front.centers_m[t, 2] = x, y, z
    front.pivots_m[t, 0], front.pivots_m[t, 1], front.pivots_m[t, 2] = x, y, z
    front.radius_index[t] = radius_index
    for k in range(3):
        start, end = front.triangles[t, k], front.triangles[t, (k + 1) % 3]
        edge = 3 * t + k
        twin = find(front, end, start)
        if front.outgoing[start] < 0 and not front.given_up[start]:
            front.counts[SETTLED] += 1
        front.end[edge], front.twin[edge] = end, twin
        front.following[edge], front.outgoing[start] = front.outgoing[start], edge
        if twin >= 0:
            front.twin[twin] = edge
            front.open_count[end] -= 1
        else:
            front.open_count[start] += 1
            front.queue[front.counts[TAIL]] = edge
            front.counts[TAIL] += 1
