"""The growing mesh and its front, as half-edges in arrays.

Half-edge 3 t + k leads from corner k of triangle t to its next corner. The front is the half-edges
without a twin. Gluing two of them is setting their twins: whether that closes a loop of two, shortens
a loop, splits one or merges two (the four cases of Bernardini et al. 1999) follows from the twins.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pipeline.surface.pivoting.compiled import compiled
from pipeline.types import ByteArray, FloatArray, IntArray

FACES, HEAD, TAIL, CURSOR, SETTLED = range(5)
"""Places in ``Front.counts``: triangles; the queue from head to tail; next seed; points used or given up."""


class Front(NamedTuple):
    """State of the algorithm between two balls; arrays of length F have room for more triangles."""

    triangles: IntArray
    """(F, 3) int32, anticlockwise from the outside."""
    centers_m: FloatArray
    """(F, 3) centre of the ball that made each triangle."""
    pivots_m: FloatArray
    """(F, 3) centre of the ball of the present radius on it."""
    radius_index: ByteArray
    """(F,) which radius made it."""
    twin: IntArray
    """(3 F,) opposite half-edge, -1 on the front."""
    end: IntArray
    """(3 F,) point where each half-edge ends."""
    following: IntArray
    """(3 F,) next half-edge that starts at the same point, -1 for none."""
    outgoing: IntArray
    """(N,) first half-edge from each point, -1 for an unused point."""
    open_count: IntArray
    """(N,) half-edges from each point that are on the front."""
    given_up: ByteArray
    """(N,) 1 where no ball of the present radius makes a seed."""
    queue: IntArray
    """(3 F,) half-edges to pivot about."""
    counts: IntArray
    """(5,)."""


def new_front(n_points: int) -> Front:
    """No triangle yet."""
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
    """The same front with room for half as many triangles more."""
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
    """The half-edge from a to b, -1 for none."""
    edge = front.outgoing[a]
    while edge >= 0 and front.end[edge] != b:
        edge = front.following[edge]
    return edge


@compiled
def can_join(front, a, x, b):  # type: ignore[no-untyped-def]
    """Whether half-edges a to x and x to b may be added: x is not interior, and the edges are free."""
    if front.outgoing[x] < 0:
        return True
    return front.open_count[x] > 0 and find(front, a, x) < 0 and find(front, x, b) < 0


@compiled
def add_triangle(front, a, b, c, x, y, z, radius_index):  # type: ignore[no-untyped-def]
    """Add a triangle with its ball's centre, glue its edges to the front, queue those that are new on it."""
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
