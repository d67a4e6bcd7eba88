"""Voronoi cell of a point, clipped within a ball's reach, to find the empty balls that touch the point.

An empty ball of a given radius touches point p if its centre is a point of p's cell at that distance
from p. The cell is convex, so there is such a centre only if a corner is at least that far away. The ball
rests on two more points if its centre is on an edge of the cell; these two points belong to such a corner.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pipeline.surface.pivoting.ball import TIE
from pipeline.surface.pivoting.compiled import compiled
from pipeline.types import BoolArray, FloatArray, IntArray

BOX = 6
"""Number of planes of the initial box, which come first; the other planes belong to points."""
_MOST_PLANES = 128
_MOST_CORNERS = 512
_BOX_REACH = 1.5
"""Ratio of half the box's side to the ball's radius."""


class Cell(NamedTuple):
    """Work arrays for one half of a cell, with its point as origin; three planes meet at each corner."""

    planes: FloatArray
    """(P, 4) planes: n and h of n . x <= h."""
    rows: IntArray
    """(P,) neighbour of each plane."""
    corners: IntArray
    """(C, 3) planes of each corner, anticlockwise from the outside."""
    at: FloatArray
    """(C, 4) position of each corner, and its squared distance from the origin."""
    final: BoolArray
    """(C,) True where no neighbour cuts the corner off."""
    cut: BoolArray
    """(P, P) edges of the corners that are being cut off; all False between two cuts."""
    counts: IntArray
    """(2,) numbers of planes and corners."""


def new_cell() -> Cell:
    """Allocate the arrays of a cell, which can be reused for many points."""
    return Cell(
        np.empty((_MOST_PLANES, 4)),
        np.empty(_MOST_PLANES, np.int32),
        np.empty((_MOST_CORNERS, 3), np.int32),
        np.empty((_MOST_CORNERS, 4)),
        np.empty(_MOST_CORNERS, np.bool_),
        np.zeros((_MOST_PLANES, _MOST_PLANES), np.bool_),
        np.zeros(2, np.int64),
    )


@compiled
def begin(cell, nx, ny, nz, radius):  # type: ignore[no-untyped-def]
    """Start with a half box that contains the ball's possible centres on the side of a unit vector n."""
    sign = 1.0 if nz >= 0.0 else -1.0
    a = -1.0 / (sign + nz)  # orthonormal basis of Duff et al. 2017
    b = nx * ny * a
    cell.counts[0], cell.counts[1] = BOX, 0
    for side in range(2):
        s = 1.0 - 2.0 * side
        _set_plane(cell, side, s * (1.0 + sign * nx * nx * a), s * sign * b, -s * sign * nx)
        _set_plane(cell, 2 + side, s * b, s * (sign + ny * ny * a), -s * ny)
        _set_plane(cell, 4 + side, s * nx, s * ny, s * nz)
    for plane in range(BOX):
        cell.planes[plane, 3] = _BOX_REACH * radius if plane < BOX - 1 else 0.0
    for x in range(2):
        for y in range(2, 4):
            for z in range(4, 6):
                if (x + y + z) % 2 == 0:
                    _add_corner(cell, x, y, z)
                else:
                    _add_corner(cell, x, z, y)


@compiled
def _set_plane(cell, plane, x, y, z):  # type: ignore[no-untyped-def]
    cell.planes[plane, 0], cell.planes[plane, 1], cell.planes[plane, 2] = x, y, z


@compiled
def shrink(cell, near, count, radius, expected):  # type: ignore[no-untyped-def]
    """Cut by the (count, 4) neighbours x, y, z, |x|^2 / 2 until every far corner is final; count these.

    Far means at least ``radius``. Each cut is by the neighbour nearest to the farthest corner. It stops
    when ``expected`` corners are final, and returns -1 if the arrays are full.
    """
    far2 = radius * radius * (1.0 - 1e-9)
    while True:
        corner, n_final = -1, 0
        for n in range(cell.counts[1]):
            if cell.at[n, 3] >= far2:
                if cell.final[n]:
                    n_final += 1
                elif corner < 0 or cell.at[n, 3] > cell.at[corner, 3]:
                    corner = n
        if corner < 0 or n_final >= expected:
            return n_final
        x, y, z = cell.at[corner, 0], cell.at[corner, 1], cell.at[corner, 2]
        depth, row = -TIE * radius * radius, -1
        for n in range(count):
            outside = near[n, 3] - x * near[n, 0] - y * near[n, 1] - z * near[n, 2]
            if outside < depth:
                depth, row = outside, n
        if row < 0:
            cell.final[corner] = True
        elif not _clip(cell, near, row):
            return -1


@compiled
def _clip(cell, near, row):  # type: ignore[no-untyped-def]
    """Cut off the part that is nearer to a neighbour than to the origin; False if the arrays are full."""
    new = cell.counts[0]
    if new == _MOST_PLANES or 2 * cell.counts[1] + new > _MOST_CORNERS:
        return False
    cell.counts[0] += 1
    cell.rows[new] = row
    for axis in range(4):
        cell.planes[new, axis] = near[row, axis]
    x, y, z, h = near[row, 0], near[row, 1], near[row, 2], near[row, 3]
    kept, count = 0, cell.counts[1]
    for n in range(count):  # move the corners to cut off to the end
        if cell.at[n, 0] * x + cell.at[n, 1] * y + cell.at[n, 2] * z <= h:
            _swap(cell, n, kept)
            kept += 1
    for n in range(kept, count):
        for k in range(3):
            cell.cut[cell.corners[n, k], cell.corners[n, (k + 1) % 3]] = True
    for n in range(kept, count):
        for k in range(3):
            a, b = cell.corners[n, k], cell.corners[n, (k + 1) % 3]
            if not cell.cut[b, a]:
                _add_corner(cell, a, b, new)
    for n in range(kept, count):
        for k in range(3):
            cell.cut[cell.corners[n, k], cell.corners[n, (k + 1) % 3]] = False
    for n in range(count, cell.counts[1]):
        _swap(cell, n, kept + n - count)
    cell.counts[1] -= count - kept
    return True


@compiled
def _swap(cell, m, n):  # type: ignore[no-untyped-def]
    for k in range(3):
        cell.corners[m, k], cell.corners[n, k] = cell.corners[n, k], cell.corners[m, k]
    for k in range(4):
        cell.at[m, k], cell.at[n, k] = cell.at[n, k], cell.at[m, k]
    cell.final[m], cell.final[n] = cell.final[n], cell.final[m]


@compiled
def _add_corner(cell, a, b, c):  # type: ignore[no-untyped-def]
    """Add the corner where three planes meet; it is at the origin if they do not meet in a point."""
    ax, ay, az, ah = cell.planes[a, 0], cell.planes[a, 1], cell.planes[a, 2], cell.planes[a, 3]
    bx, by, bz, bh = cell.planes[b, 0], cell.planes[b, 1], cell.planes[b, 2], cell.planes[b, 3]
    cx, cy, cz, ch = cell.planes[c, 0], cell.planes[c, 1], cell.planes[c, 2], cell.planes[c, 3]
    ux, uy, uz = by * cz - bz * cy, bz * cx - bx * cz, bx * cy - by * cx
    vx, vy, vz = cy * az - cz * ay, cz * ax - cx * az, cx * ay - cy * ax
    wx, wy, wz = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
    volume = ax * ux + ay * uy + az * uz
    scale = 1.0 / volume if volume != 0.0 else 0.0
    x = (ah * ux + bh * vx + ch * wx) * scale
    y = (ah * uy + bh * vy + ch * wy) * scale
    z = (ah * uz + bh * vz + ch * wz) * scale
    n = cell.counts[1]
    cell.counts[1] += 1
    cell.corners[n, 0], cell.corners[n, 1], cell.corners[n, 2] = a, b, c
    cell.at[n, 0], cell.at[n, 1], cell.at[n, 2], cell.at[n, 3] = x, y, z, x * x + y * y + z * z
    cell.final[n] = False
