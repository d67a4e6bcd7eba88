"""Comparison of two poses of a source relative to a target, and lengths as text."""

from __future__ import annotations

import numpy as np

from pipeline.kernels.geometry import rotation_angle_rad
from pipeline.registration.global_start import default_voxel_m
from pipeline.registration.metrics import point_error_m
from pipeline.types import FloatArray, PointCloud

SAME_DEG, SAME_VOXELS = 1.5, 0.8
"""Two poses that differ by less, in degrees and in fiftieths of the target's extent, are the same answer: 1.5
degrees and 5 cm in a view of 3 m."""
COMPARED_POINTS = 1000
STRAY_MEDIANS = 10.0
"""A point farther from the middle of a cloud than this many times the median distance is a stray."""


def same(T_a: FloatArray, T_b: FloatArray, source: PointCloud, target: PointCloud) -> bool:
    """Return whether two poses of a source relative to a target are the same answer."""
    apart_m = point_error_m(T_a, T_b, compared_points_m(source))
    return turn_deg(T_a, T_b) < SAME_DEG and apart_m < SAME_VOXELS * default_voxel_m(target)


def turn_deg(T_a: FloatArray, T_b: FloatArray) -> float:
    """Return the angle between the rotations of two (4, 4) poses, rigid or with a scale."""
    relative = T_a[:3, :3].T @ T_b[:3, :3]
    return float(np.degrees(rotation_angle_rad(relative / np.cbrt(np.linalg.det(relative)))))


def compared_points_m(cloud: PointCloud) -> FloatArray:
    """Return (n, 3) points by which poses are compared, fewer than 2000 and without strays: at an error of
    0.001 degrees, a few points at a distance of a kilometre would outweigh all others.
    """
    some_m = cloud.points_m[:: max(1, len(cloud) // COMPARED_POINTS)]
    away_m = np.linalg.norm(some_m - np.median(some_m, axis=0), axis=1)
    return some_m[away_m <= STRAY_MEDIANS * np.median(away_m)]


def length(metres: float) -> str:
    """Return a length as text: metres with three digits or whole ones, or centimetres with two digits."""
    if metres >= 999.5:
        return f"{metres:.0f} m"
    return f"{metres:.3g} m" if metres >= 0.995 else f"{100.0 * metres:.2g} cm"
