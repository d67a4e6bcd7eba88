"""Search for the place on a surface nearest to a given point, which must be near the surface."""

from __future__ import annotations

import numpy as np

from packetmesh.errors import InputError
from pipeline.measuring.lookup import Spot, lookup_of
from pipeline.measuring.surface import MeasuredSurface
from pipeline.types import FloatArray

NEAR_M = 0.05
NEAR_SPACINGS = 3.0
"""A point is near the surface within the larger of these distances, in m and in spacings of the vertices."""


def spot_near(surface: MeasuredSurface, point_m: FloatArray) -> Spot:
    """Return the place of a surface nearest to a point.

    Raises:
        InputError: the point is not finite, or nothing of the surface is near it.
    """
    point_m = np.asarray(point_m, float)
    if point_m.shape != (3,) or not np.isfinite(point_m).all():
        raise InputError(f"The point {point_m.tolist()} is no place; try three numbers x, y, z in metres")
    lookup = lookup_of(surface)
    spot = lookup.nearest(point_m)
    away_m = float(np.linalg.norm(spot.point_m - point_m))
    if away_m > max(NEAR_M, NEAR_SPACINGS * lookup.spacing_m):
        given = "({:.3g}, {:.3g}, {:.3g})".format(*point_m)
        there = "{:.3f},{:.3f},{:.3f}".format(*spot.point_m)
        raise InputError(
            f"Nothing of the surface is near the point {given}; the nearest place, {away_m:.2g} m away, is "
            f"{there}"
        )
    return spot
