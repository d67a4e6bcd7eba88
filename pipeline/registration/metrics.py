"""Errors of a registration against the true pose, and the distance of two clouds (SPEC 4.7)."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from pipeline.kernels.geometry import apply, rotation_angle_rad
from pipeline.types import FloatArray


def point_error_m(T_estimated: FloatArray, T_true: FloatArray, points_m: FloatArray) -> float:
    """Return the RMS distance in metres of (N, 3) points moved by estimate and truth: the primary error.

    >>> import numpy as np, packetmesh as pm
    >>> T_true = np.eye(4); T_true[0, 3] = 0.25
    >>> pm.point_error_m(np.eye(4), T_true, np.zeros((10, 3)))
    0.25
    """
    return float(np.sqrt(np.mean(np.sum(apply(T_estimated - T_true, points_m) ** 2, axis=1))))


def rotation_error_rad(T_estimated: FloatArray, T_true: FloatArray) -> float:
    """Return the angle between the rotations of two rigid (4, 4) transforms."""
    return rotation_angle_rad(T_estimated[:3, :3] @ T_true[:3, :3].T)


def average_hausdorff_m(a_m: FloatArray, b_m: FloatArray) -> float:
    """Return the average Hausdorff distance of (N, 3) and (M, 3) points: mean of both directed means.

    It hardly discriminates when one cloud has holes: use ``point_error_m`` if the truth is known.
    """
    a_to_b_m, _ = cKDTree(b_m).query(a_m, workers=-1)
    b_to_a_m, _ = cKDTree(a_m).query(b_m, workers=-1)
    return float(0.5 * (a_to_b_m.mean() + b_to_a_m.mean()))
