"""The points that the ball left out, and the ball's rest position on the others."""

from __future__ import annotations

import numpy as np

from app.screens.surface.view import Ray, UnusedView
from pipeline.types import BoolArray, FloatArray, PointCloud, PointSource, Surface

NEARLY_NOTHING = 0.05
"""Share of the points below which a mesh is no surface: all points are shown."""
MOST_POINTS = 30_000
POINT_SHARE = 0.5
"""Size of a drawn point over the mean distance of nearest points."""
AIM = 0.01
"""Tangent of the angle to a ray within which points are candidates; also the share of the nearest candidate's
distance by which others may be farther away and still count as equally near."""


def unused_view(cloud: PointCloud, surface: Surface, size_m: float, most: int = MOST_POINTS) -> UnusedView:
    """Return the points of a cloud that no triangle of its surface uses; all if the surface is nearly empty.

    Args:
        cloud: the cloud over which the ball rolled.
        surface: the surface that the ball made of the cloud.
        size_m: size of a drawn point.
        most: largest number of points; more are thinned evenly.
    """
    rows = np.flatnonzero(_unused(cloud.points_m, surface))
    rows = rows[:: max(1, -(-len(rows) // most))]
    points_m = cloud.points_m[rows].astype(np.float32)
    inferred = np.zeros(len(rows), bool)
    if cloud.source is not None:
        inferred = cloud.source[rows] == PointSource.INFERRED
    return UnusedView(points_m[~inferred], points_m[inferred], size_m)


def _unused(points_m: FloatArray, surface: Surface) -> BoolArray:
    """Return (N,) True for points that are no vertex; True for all if nearly none is one."""
    unused = np.ones(len(points_m), bool)
    if surface.rows is not None and len(surface.rows) >= NEARLY_NOTHING * len(points_m):
        unused[surface.rows] = False
    return unused


def resting_ball_m(cloud: PointCloud, ray: Ray, radius_m: float) -> FloatArray | None:
    """Return (3,) the centre of a ball at rest on the point that a ray selects; None if none is ahead.

    Args:
        cloud: points with outward normals.
        ray: it selects the first point very near to it or, if there is none, the nearest by angle.
        radius_m: radius of the ball.
    """
    origin_m, direction = np.array(ray.origin_m), np.array(ray.direction)
    direction = direction / max(float(np.linalg.norm(direction)), 1e-12)
    from_origin_m = cloud.points_m - origin_m
    ahead_m = from_origin_m @ direction
    beside_m = np.linalg.norm(from_origin_m - ahead_m[:, None] * direction, axis=1)
    slope = np.divide(beside_m, ahead_m, out=np.full(len(ahead_m), np.inf), where=ahead_m > 1e-6)
    if cloud.normals is None or not np.isfinite(slope).any():
        return None
    meant = slope <= max(AIM, float(slope.min()))
    meant &= ahead_m <= (1.0 + AIM) * ahead_m[meant].min()
    row = int(np.where(meant, slope, np.inf).argmin())
    resting_m: FloatArray = cloud.points_m[row] + radius_m * cloud.normals[row]
    return resting_m
