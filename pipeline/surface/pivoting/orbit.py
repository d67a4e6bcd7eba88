"""Circular path of a ball's centre when it pivots about an edge, and the first point that it meets."""

from __future__ import annotations

import numpy as np

from pipeline.surface.pivoting.ball import TIE
from pipeline.surface.pivoting.compiled import compiled


@compiled
def orbit(points, a, b, toward_x, toward_y, toward_z, radius):  # type: ignore[no-untyped-def]
    """Return the circle about edge a to b: middle, axis u, axis v, radius, and squared half of the edge.

    Angle 0, along u, is in the given direction from the edge's middle; angles grow towards v, the way a
    ball on a triangle to the left of the edge pivots. The radius is 0 if there is no circle.
    """
    tx, ty, tz = points[b, 0] - points[a, 0], points[b, 1] - points[a, 1], points[b, 2] - points[a, 2]
    length2 = tx * tx + ty * ty + tz * tz
    scale = 1.0 / np.sqrt(length2)
    tx, ty, tz = tx * scale, ty * scale, tz * scale
    along = toward_x * tx + toward_y * ty + toward_z * tz
    ux, uy, uz = toward_x - along * tx, toward_y - along * ty, toward_z - along * tz
    u2 = ux * ux + uy * uy + uz * uz
    mx, my, mz = points[a, 0] + points[b, 0], points[a, 1] + points[b, 1], points[a, 2] + points[b, 2]
    orbit2 = radius * radius - 0.25 * length2
    if orbit2 <= TIE * radius * radius or u2 <= 0.0:
        return 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    scale = 1.0 / np.sqrt(u2)
    ux, uy, uz = ux * scale, uy * scale, uz * scale
    vx, vy, vz = ty * uz - tz * uy, tz * ux - tx * uz, tx * uy - ty * ux
    return 0.5 * mx, 0.5 * my, 0.5 * mz, ux, uy, uz, vx, vy, vz, np.sqrt(orbit2), 0.25 * length2


@compiled
def center_at(frame, cosine, sine):  # type: ignore[no-untyped-def]
    """Return (x, y, z) of the ball's centre at an angle."""
    mx, my, mz, ux, uy, uz, vx, vy, vz, size, _ = frame
    s, t = size * cosine, size * sine
    return mx + s * ux + t * vx, my + s * uy + t * vy, mz + s * uz + t * vz


@compiled
def in_plane(frame, x, y, z):  # type: ignore[no-untyped-def]
    """Return (px, py, level, flat2, rest2) of a point; it is on the ball where px cos + py sin = level.

    (px, py) is the point projected into the circle's plane, relative to its middle, with squared length
    flat2; rest2 = flat2 - level^2 is negative if the ball never touches the point.
    """
    mx, my, mz, ux, uy, uz, vx, vy, vz, size, half2 = frame
    dx, dy, dz = x - mx, y - my, z - mz
    px, py = dx * ux + dy * uy + dz * uz, dx * vx + dy * vy + dz * vz
    level = (dx * dx + dy * dy + dz * dz - half2) / (2.0 * size)
    flat2 = px * px + py * py
    return px, py, level, flat2, flat2 - level * level


@compiled
def _is_before(cosine, sine, other_cosine, other_sine):  # type: ignore[no-untyped-def]
    """Return whether one angle in [0, 2 pi) is smaller than another, from scaled cosines and sines."""
    if (sine < 0.0) != (other_sine < 0.0):
        return other_sine < 0.0
    return sine * other_cosine < cosine * other_sine


@compiled
def first_met(grid, rows, count, a, b, frame):  # type: ignore[no-untyped-def]
    """Return (row, cosine, sine) of the first point that an empty ball meets from angle 0; row -1 if none.

    A point ahead that the ball already touches, or overlaps by rounding, is met at once.
    """
    hit, first_cosine, first_sine, first_scale = -1, 1.0, 0.0, 1.0
    tie = TIE * np.sqrt(frame[9] * frame[9] + frame[10])
    for n in range(count):
        row = rows[n]
        px, py, level, flat2, rest2 = in_plane(
            frame, grid.points_m[row, 0], grid.points_m[row, 1], grid.points_m[row, 2]
        )
        if rest2 < 0.0 or flat2 <= 0.0 or grid.ids[row] in (a, b):
            continue
        cosine, sine, scale = 1.0, 0.0, 1.0
        if py <= 0.0 or px - level < -tie:
            rest = np.sqrt(rest2)
            cosine, sine, scale = level * px + rest * py, level * py - rest * px, flat2
        if hit < 0 or _is_before(cosine, sine, first_cosine, first_sine):
            hit, first_cosine, first_sine, first_scale = row, cosine, sine, scale
    return hit, first_cosine / first_scale, first_sine / first_scale
