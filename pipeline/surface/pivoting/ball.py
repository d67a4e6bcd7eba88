"""Geometry of a ball that rests on three points."""

from __future__ import annotations

import numpy as np

from pipeline.surface.pivoting.compiled import compiled
from pipeline.surface.pivoting.grid import gather

TIE = 1e-12
"""Penetration depth, as a share of the radius, up to which a point is on the ball, not inside (rounding)."""
_TOUCH = 1e-10
"""Largest distance of a ball's surface from its three points, as a share of the radius (rounding)."""


@compiled
def ball_center(points, a, b, c, radius):  # type: ignore[no-untyped-def]
    """Return (x, y, z, exists): centre of the ball through three points, on their anticlockwise side.

    It is the circumcentre plus sqrt(radius^2 - R^2) along the triangle's normal (SPEC 5.1).
    """
    ux, uy, uz = points[b, 0] - points[a, 0], points[b, 1] - points[a, 1], points[b, 2] - points[a, 2]
    vx, vy, vz = points[c, 0] - points[a, 0], points[c, 1] - points[a, 1], points[c, 2] - points[a, 2]
    nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    n2, u2, v2 = nx * nx + ny * ny + nz * nz, ux * ux + uy * uy + uz * uz, vx * vx + vy * vy + vz * vz
    if n2 <= 0.0:
        return 0.0, 0.0, 0.0, False
    s, t = 0.5 * v2 / n2, 0.5 * u2 / n2
    x = s * (ny * uz - nz * uy) + t * (vy * nz - vz * ny)
    y = s * (nz * ux - nx * uz) + t * (vz * nx - vx * nz)
    z = s * (nx * uy - ny * ux) + t * (vx * ny - vy * nx)
    height2 = radius * radius - (x * x + y * y + z * z)
    if not height2 >= 0.0:
        return 0.0, 0.0, 0.0, False
    height = np.sqrt(height2 / n2)
    x, y, z = points[a, 0] + x + height * nx, points[a, 1] + y + height * ny, points[a, 2] + z + height * nz
    touches = (
        is_on(points, a, x, y, z, radius)
        and is_on(points, b, x, y, z, radius)
        and is_on(points, c, x, y, z, radius)
    )
    return x, y, z, touches


@compiled
def is_on(points, p, x, y, z, radius):  # type: ignore[no-untyped-def]
    """Return whether a point is on a ball, up to rounding."""
    dx, dy, dz = points[p, 0] - x, points[p, 1] - y, points[p, 2] - z
    return abs(np.sqrt(dx * dx + dy * dy + dz * dz) - radius) <= _TOUCH * radius


@compiled
def is_empty(grid, found, a, b, c, x, y, z, radius):  # type: ignore[no-untyped-def]
    """Return whether no point of the cloud other than a, b and c is inside a ball."""
    for n in range(gather(grid, x, y, z, radius * (1.0 - TIE), found)):
        p = grid.ids[found[n]]
        if p != a and p != b and p != c:
            return False
    return True


@compiled
def agrees(points, normals, a, b, c):  # type: ignore[no-untyped-def]
    """Return whether the triangle's normal has a positive dot product with those of its three points."""
    ux, uy, uz = points[b, 0] - points[a, 0], points[b, 1] - points[a, 1], points[b, 2] - points[a, 2]
    vx, vy, vz = points[c, 0] - points[a, 0], points[c, 1] - points[a, 1], points[c, 2] - points[a, 2]
    nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    least = 1e-9 * np.sqrt(nx * nx + ny * ny + nz * nz)
    return (
        nx * normals[a, 0] + ny * normals[a, 1] + nz * normals[a, 2] > least
        and nx * normals[b, 0] + ny * normals[b, 1] + nz * normals[b, 2] > least
        and nx * normals[c, 0] + ny * normals[c, 1] + nz * normals[c, 2] > least
    )
