"""Checks of a cloud before its surface is computed: its points, unit, width and resolution."""

from __future__ import annotations

import logging
import math
from dataclasses import replace

import numpy as np

from packetmesh.errors import InputError
from pipeline.io.cloud_precision import too_coarse
from pipeline.kernels.point_sets import distinct_rows
from pipeline.surface.given_normals import MOST_UNKNOWN_SHARE, known_normals
from pipeline.types import FloatArray, PointCloud

_log = logging.getLogger(__name__)

LEAST_POINTS = 3
USUAL_M = 0.05, 50.0
"""Usual range of widths: from objects to houses."""
OUTER_PERCENT = 1.0
"""Per cent of the points on either side that do not count for a cloud's width, because of outliers."""
LARGEST_M, SMALLEST_M = 1e9, 1e-12
"""Largest allowed coordinate, and the extent below which a cloud counts as one point."""
_COARSE = 0.1
"""Coordinates in steps above this share of the smallest ball make a rough surface."""
_LINE = 1e-6
"""A cloud is a line if it is thinner than this share of its length."""


def usable_points(cloud: PointCloud) -> PointCloud:
    """Return the distinct points in their order, without those whose normal is unknown.

    If many normals are unknown, all points stay and all normals are left out; other normals become unit
    vectors.

    Raises:
        InputError: fewer than three points, all of them coincident or collinear, or a coordinate too large.
    """
    first = distinct_rows(cloud.points_m)
    if len(first) < len(cloud):
        _log.warning("%d repeated points are left out", len(cloud) - len(first))
        cloud = cloud.select(first)
    cloud = _known_normals(cloud)
    check_shape(cloud.points_m)
    return cloud


def check_unit(metres_per_unit: float) -> None:
    """Check the length of a unit.

    Raises:
        InputError: the length is not finite or not positive.
    """
    if not (math.isfinite(metres_per_unit) and metres_per_unit > 0.0):
        raise InputError(f"There cannot be {metres_per_unit:g} metres in a unit; try 0.001 for millimetres")


def in_metres(cloud: PointCloud, metres_per_unit: float) -> PointCloud:
    """Convert a cloud to metres.

    Raises:
        InputError: the unit's length is not finite or not positive.
    """
    check_unit(metres_per_unit)
    if metres_per_unit == 1.0:
        return cloud
    return replace(cloud, points_m=metres_per_unit * cloud.points_m)


def width_of(cloud: PointCloud) -> float:
    """Return the longest side of the box around the points, without ``OUTER_PERCENT`` at each end."""
    low_m, high_m = np.percentile(cloud.points_m, [OUTER_PERCENT, 100.0 - OUTER_PERCENT], axis=0)
    return float((high_m - low_m).max())


def doubtful_unit(width_m: float, metres_per_unit: float) -> str | None:
    """Return a warning for a cloud that is larger than a house or too small for a depth camera, or None."""
    if USUAL_M[0] <= width_m <= USUAL_M[1]:
        return None
    if width_m > USUAL_M[1]:
        advice = f"if its numbers are millimetres, try --metres-per-unit {0.001 * metres_per_unit:.3g}"
    else:
        advice = "if it is wider in truth, say so with --metres-per-unit"
    return f"The cloud is {width_m:.3g} m wide; {advice}"


def _known_normals(cloud: PointCloud) -> PointCloud:
    """Normalise the normals; leave out points without one, or all normals if many points have none."""
    if cloud.normals is None:
        return cloud
    known = known_normals(cloud.normals)
    if not known.any():
        _log.warning("All normals of the file are zero or not finite; they are estimated from the points")
        return replace(cloud, normals=None)
    unknown = int((~known).sum())
    if unknown > MOST_UNKNOWN_SHARE * len(cloud):
        _log.warning(
            "%d of %d normals of the file are zero or not finite; all are estimated from the points",
            unknown,
            len(cloud),
        )
        return replace(cloud, normals=None)
    if unknown:
        _log.warning(
            "%d points are left out: their normals are zero or not finite; --estimate-normals keeps them",
            unknown,
        )
        cloud = cloud.select(known)
    assert cloud.normals is not None
    return replace(cloud, normals=cloud.normals / np.linalg.norm(cloud.normals, axis=1, keepdims=True))


def check_shape(points_m: FloatArray) -> None:
    """Check that (N, 3) points, at least one, can span a surface.

    Raises:
        InputError: fewer than three points, all of them coincident or collinear, or a coordinate too large.
    """
    reach_m, extent_m = float(np.abs(points_m).max()), float(np.ptp(points_m, axis=0).max())
    if reach_m > LARGEST_M:
        raise InputError(
            f"A point of the cloud has a coordinate of {reach_m:.3g} m; check its file and its units"
        )
    if extent_m < SMALLEST_M:
        raise InputError("All points of the cloud are in one place; check its file")
    if len(points_m) < LEAST_POINTS:
        raise InputError(
            f"The cloud has {len(points_m)} distinct points; a surface needs at least {LEAST_POINTS}, "
            "so check its file"
        )
    centered = (points_m - points_m.mean(axis=0)) / extent_m
    widths = np.sqrt(np.maximum(np.linalg.eigvalsh(centered.T @ centered), 0.0))
    if widths[1] <= _LINE * widths[2]:
        raise InputError(
            f"The {len(points_m)} points of the cloud lie on one line; a surface needs points off that line"
        )


def middle_reach_m(points_m: FloatArray) -> float:
    """Return the largest coordinate, by magnitude, of the points' median."""
    return float(np.abs(np.median(points_m, axis=0)).max())


def check_resolution(points_m: FloatArray, radius_m: float) -> None:
    """Check that the 32-bit floats of a mesh file are fine enough for points so far from the origin.

    Raises:
        InputError: their steps are too coarse for a ball of ``radius_m``.
    """
    step_m = float(np.spacing(np.float32(middle_reach_m(points_m))))
    if step_m > _COARSE * radius_m:
        raise InputError(
            f"The cloud is {middle_reach_m(points_m):.4g} m from the origin, where the numbers of a mesh "
            f"file are {step_m:.2g} m apart; try to move it nearer to the origin"
        )


def warn_of_rounding(points_m: FloatArray, radius_m: float) -> None:
    """Log a warning if a far cloud was rounded to 32-bit numbers whose steps are coarse for a ball."""
    reach_m = middle_reach_m(points_m)
    step_m = float(np.spacing(np.float32(reach_m)))
    if step_m <= _COARSE * radius_m or too_coarse(points_m):
        return
    axis = int(np.abs(np.median(points_m, axis=0)).argmax())
    steps_m = np.diff(np.unique(points_m[:, axis]))
    if len(steps_m) and steps_m.min() < 1.5 * step_m:  # a grid of heights has larger steps
        _log.warning(
            "The cloud is %.4g m from the origin, where 32-bit numbers are %.2g m apart, and its positions "
            "are rounded to them; try to export it with 64-bit numbers, or nearer to the origin",
            reach_m,
            step_m,
        )
