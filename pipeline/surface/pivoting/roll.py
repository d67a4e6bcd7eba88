"""The compiled main loop: pivot about the front's edges, then place the ball on a new seed."""

from __future__ import annotations

import numpy as np

from pipeline.surface.pivoting.ball import agrees, ball_center, is_empty, is_on
from pipeline.surface.pivoting.compiled import compiled
from pipeline.surface.pivoting.front import CURSOR, FACES, HEAD, SETTLED, TAIL, add_triangle, can_join
from pipeline.surface.pivoting.grid import gather
from pipeline.surface.pivoting.orbit import center_at, first_met, orbit
from pipeline.surface.pivoting.seed import find_seed

_NEAR = 1.0
"""The first search about an edge covers balls that move by up to this many edge lengths."""


@compiled
def advance(points, normals, grid, front, scratch, radius, radius_index, limit):  # type: ignore[no-untyped-def]
    """Continue rolling until there are ``limit`` triangles; True if this ball can make no more."""
    counts = front.counts
    while counts[FACES] < limit:
        if counts[HEAD] < counts[TAIL]:
            edge = front.queue[counts[HEAD]]
            counts[HEAD] += 1
            if front.twin[edge] < 0:
                _roll_over(points, normals, grid, front, scratch.found, edge, radius, radius_index)
        elif counts[CURSOR] < len(grid.ids):
            p = grid.ids[counts[CURSOR]]
            counts[CURSOR] += 1
            if front.outgoing[p] < 0:
                b, c, x, y, z = find_seed(points, normals, grid, front, scratch, p, radius)
                if b >= 0:
                    add_triangle(front, p, b, c, x, y, z, radius_index)
                else:
                    front.given_up[p] = 1
                    counts[SETTLED] += 1
        else:
            return True
    return False


@compiled
def restart(points, grid, front, scratch, radius):  # type: ignore[no-untyped-def]
    """Start with a larger ball: queue the front's edges on whose triangle it rests with no point inside."""
    counts = front.counts
    counts[HEAD], counts[TAIL], counts[CURSOR], counts[SETTLED] = 0, 0, 0, 0
    for p in range(len(front.outgoing)):
        front.given_up[p] = 0
        counts[SETTLED] += front.outgoing[p] >= 0
    for t in range(counts[FACES]):
        if front.twin[3 * t] >= 0 and front.twin[3 * t + 1] >= 0 and front.twin[3 * t + 2] >= 0:
            continue
        a, b, c = front.triangles[t]
        x, y, z, exists = ball_center(points, a, b, c, radius)
        if not exists or not is_empty(grid, scratch.found, a, b, c, x, y, z, radius):
            continue
        front.pivots_m[t, 0], front.pivots_m[t, 1], front.pivots_m[t, 2] = x, y, z
        for edge in range(3 * t, 3 * t + 3):
            if front.twin[edge] < 0:
                front.queue[counts[TAIL]] = edge
                counts[TAIL] += 1


@compiled
def _roll_over(points, normals, grid, front, found, edge, radius, radius_index):  # type: ignore[no-untyped-def]
    """Pivot about one edge and join the point that stops the ball; otherwise the edge stays boundary."""
    t = edge // 3
    a, b = front.triangles[t, edge - 3 * t], front.end[edge]
    hit, x, y, z = pivot(points, grid, found, a, b, front.pivots_m[t], radius)
    if (
        hit >= 0
        and can_join(front, a, hit, b)
        and agrees(points, normals, b, a, hit)
        and is_on(points, hit, x, y, z, radius)
    ):
        add_triangle(front, b, a, hit, x, y, z, radius_index)


@compiled
def pivot(points, grid, found, a, b, center, radius):  # type: ignore[no-untyped-def]
    """Return (hit, x, y, z): the point that stops a ball pivoting about edge a to b, and the ball's centre.

    The ball rests on a triangle to the left of the edge and pivots to the right. Points near the ball are
    tested first: if one stops it within that distance, no farther point can stop it earlier.

    Returns:
        hit is -1 if no point stops the ball.
    """
    toward_x = center[0] - 0.5 * (points[a, 0] + points[b, 0])
    toward_y = center[1] - 0.5 * (points[a, 1] + points[b, 1])
    toward_z = center[2] - 0.5 * (points[a, 2] + points[b, 2])
    frame = orbit(points, a, b, toward_x, toward_y, toward_z, radius)
    size = frame[9]
    if size <= 0.0:
        return -1, 0.0, 0.0, 0.0
    near = _NEAR * 2.0 * np.sqrt(frame[10])
    row, cosine, sine = -1, 1.0, 0.0
    if near < 0.9 * size:
        count = gather(grid, center[0], center[1], center[2], radius + near, found)
        row, cosine, sine = first_met(grid, found, count, a, b, frame)
    if row < 0 or sine < 0.0 or 2.0 * size * size * (1.0 - cosine) > near * near:
        count = gather(grid, frame[0], frame[1], frame[2], radius + size, found)
        row, cosine, sine = first_met(grid, found, count, a, b, frame)
    x, y, z = center_at(frame, cosine, sine)
    return grid.ids[row] if row >= 0 else -1, x, y, z
