"""Search for seeds: three unused points on which a ball can rest."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pipeline.surface.pivoting.ball import TIE, agrees, ball_center
from pipeline.surface.pivoting.cell import BOX, Cell, begin, new_cell, shrink
from pipeline.surface.pivoting.compiled import compiled
from pipeline.surface.pivoting.grid import gather
from pipeline.types import FloatArray, IntArray

_CLOSE = 1.0
"""Radius of a first search, in ball radii, which mostly suffices to show that no ball touches a point."""


class Scratch(NamedTuple):
    """Work arrays for the neighbourhood of one position."""

    found: IntArray
    """(N + 1,) rows of the grid."""
    near: FloatArray
    """(N, 4) neighbours x, y, z relative to a point, and half their squared distance."""
    rows: IntArray
    """(N,) row of the grid of each neighbour."""
    cell: Cell


def new_scratch(n_points: int) -> Scratch:
    """Allocate the work arrays for a cloud."""
    return Scratch(
        np.empty(n_points + 1, np.int32), np.empty((n_points, 4)), np.empty(n_points, np.int32), new_cell()
    )


@compiled
def find_seed(points, normals, grid, front, scratch, p, radius):  # type: ignore[no-untyped-def]
    """Return (b, c, x, y, z): the seed triangle p, b, c and its ball's centre; b is -1 for none.

    SPEC 5.1 tries pairs of unused neighbours in order of distance until an empty ball rests on them and
    p. Only corners of p's Voronoi cell can give such pairs, so this search finds the same pair. The
    ball's centre must be on the outer side of p's tangent plane.
    """
    nx, ny, nz = normals[p, 0], normals[p, 1], normals[p, 2]
    length = np.sqrt(nx * nx + ny * ny + nz * nz)
    if not length > 0.0:
        return -1, -1, 0.0, 0.0, 0.0
    begin(scratch.cell, nx / length, ny / length, nz / length, radius)
    count = _neighbours(points, grid, scratch, p, 0, 0.0, _CLOSE * radius)
    if shrink(scratch.cell, scratch.near, count, radius, 1) == 0:
        return -1, -1, 0.0, 0.0, 0.0
    scratch.cell.final[:] = False
    count = _neighbours(points, grid, scratch, p, count, _CLOSE * radius, 2.0 * radius)
    shrink(scratch.cell, scratch.near, count, radius, 1 << 30)
    return _nearest_pair(points, normals, grid, front, scratch, count, p, radius)


@compiled
def _neighbours(points, grid, scratch, p, count, beyond_m, reach_m):  # type: ignore[no-untyped-def]
    """Add the neighbours of a point between two distances to ``near``; returns the new count."""
    found, near = scratch.found, scratch.near
    x, y, z = points[p, 0], points[p, 1], points[p, 2]
    least = 0.5 * beyond_m * beyond_m if count else -1.0
    for n in range(gather(grid, x, y, z, reach_m, found)):
        row = found[n]
        dx, dy, dz = grid.points_m[row, 0] - x, grid.points_m[row, 1] - y, grid.points_m[row, 2] - z
        half2 = 0.5 * (dx * dx + dy * dy + dz * dz)
        if half2 <= least or grid.ids[row] == p:
            continue
        near[count, 0], near[count, 1], near[count, 2], near[count, 3] = dx, dy, dz, half2
        scratch.rows[count] = row
        count += 1
    return count


@compiled
def _nearest_pair(points, normals, grid, front, scratch, count, p, radius):  # type: ignore[no-untyped-def]
    """Return the seed of that pair of neighbours at a far corner of the cell whose farther one is nearest."""
    near, rows, cell = scratch.near, scratch.rows, scratch.cell
    best, seed = np.inf, (np.int64(-1), np.int64(-1), 0.0, 0.0, 0.0)
    for corner in range(cell.counts[1]):
        if not cell.final[corner]:
            continue
        for k in range(3):
            i, j = cell.corners[corner, k], cell.corners[corner, (k + 1) % 3]
            if i < BOX or j < BOX:
                continue
            i, j = cell.rows[i], cell.rows[j]
            far = max(near[i, 3], near[j, 3])
            q, r = np.int64(grid.ids[rows[i]]), np.int64(grid.ids[rows[j]])
            if far >= best or not (front.outgoing[q] < 0 and front.outgoing[r] < 0):
                continue
            if not agrees(points, normals, p, q, r):
                q, r = r, q
                if not agrees(points, normals, p, q, r):
                    continue
            x, y, z, exists = ball_center(points, p, q, r, radius)
            dx, dy, dz = x - points[p, 0], y - points[p, 1], z - points[p, 2]
            if exists and _is_free(near, count, i, j, dx, dy, dz, radius):
                best, seed = far, (q, r, x, y, z)
    return seed


@compiled
def _is_free(near, count, i, j, x, y, z, radius):  # type: ignore[no-untyped-def]
    """Return whether no neighbour except i and j is inside the ball about (x, y, z) through the origin."""
    for n in range(count):
        outside = near[n, 3] - x * near[n, 0] - y * near[n, 1] - z * near[n, 2]
        if outside < -TIE * radius * radius and n != i and n != j:
            return False
    return True
