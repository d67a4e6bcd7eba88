"""Walls and tall furniture on the floor plan, which damp a radio link that crosses them."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from pipeline.planning.places import floor_m, triangles_of
from pipeline.planning.seen import SeenPlace
from pipeline.types import BoolArray, FloatArray

DAMPING_DB = {"plaster": 3.0, "wood": 4.0, "brick": 8.0, "concrete": 15.0}
"""Power lost at a wall of a material at 2.4 GHz (SPEC 12)."""
HEIGHTS_M = 1.0, 2.2
"""Upright surface between these heights above the floor counts."""
WITHIN_M = 0.08
"""Largest distance of a surface from its wall's line."""
GAP_M = 0.4
"""A wall ends where no surface follows for this length."""
SHORTEST_M = 1.0
"""Least length of a wall."""
MOST_WALLS = 20
"""Most walls that are found."""
TRIES = 200
"""Random points through which each next wall is tried."""


def walls_of(seen: SeenPlace) -> FloatArray:
    """Return (W, 2, 2) x and y of both ends of each straight upright surface of ``SHORTEST_M`` or more.

    Lines are drawn through random pairs of measured triangles (Fischler and Bolles 1981), the line with the
    longest wall first.
    """
    normals, middles_m, _ = triangles_of(seen)
    height_m = middles_m[:, 2] - floor_m(seen)
    upright = (np.abs(normals[:, 2]) < 0.2) & (height_m > HEIGHTS_M[0]) & (height_m < HEIGHTS_M[1])
    return np.reshape(list(_lines(middles_m[upright, :2], normals[upright, :2])), (-1, 2, 2))


def _lines(points_m: FloatArray, normals: FloatArray) -> Iterator[FloatArray]:
    rng = np.random.default_rng(0)
    for _ in range(MOST_WALLS):
        if len(points_m) < 2:
            return
        found = [_wall(points_m, normals, int(row)) for row in rng.integers(len(points_m), size=TRIES)]
        ends_m, rows = max(found, key=lambda wall: float(np.linalg.norm(wall[0][1] - wall[0][0])))
        if np.linalg.norm(ends_m[1] - ends_m[0]) < SHORTEST_M:
            return
        yield ends_m
        points_m, normals = points_m[~rows], normals[~rows]


def _wall(points_m: FloatArray, normals: FloatArray, row: int) -> tuple[FloatArray, BoolArray]:
    """Return the ends of the wall through a point, across its normal, and the points that belong to it."""
    normal = normals[row] / np.linalg.norm(normals[row])
    along = np.array([-normal[1], normal[0]])
    off_m = points_m - points_m[row]
    rows = (np.abs(off_m @ normal) < WITHIN_M) & (np.abs(normals @ normal) > 0.9)
    places_m = np.sort(off_m[rows] @ along)
    here = int(np.searchsorted(places_m, 0.0))
    gaps = np.flatnonzero(np.diff(places_m) > GAP_M)
    first = int(gaps[gaps < here].max(initial=-1)) + 1
    last = int(gaps[gaps >= here].min(initial=len(places_m) - 1))
    ends_m = points_m[row] + places_m[[first, last], None] * along
    rows &= (off_m @ along >= places_m[first]) & (off_m @ along <= places_m[last])
    return ends_m, rows
