"""Normals of a cloud seen from one place."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from pipeline.errors import InputError
from pipeline.open3d_runtime import o3d
from pipeline.types import FloatArray, PointCloud


def estimate_normals(cloud: PointCloud, viewpoint_m: FloatArray, neighbours: int = 20) -> PointCloud:
    """``cloud`` with unit normals, by principal components, that point to the side of the viewpoint.

    Args:
        cloud: at least three points.
        viewpoint_m: (3,) the observing camera, in the cloud's frame.
        neighbours: how many points, itself included, make a point's tangent plane.

    Raises:
        InputError: fewer than three points or neighbours.
    """
    if min(len(cloud), neighbours) < 3:
        raise InputError(
            f"Normals need at least 3 points and 3 neighbours, not {len(cloud)} and {neighbours}; try more"
        )
    points = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(cloud.points_m))
    points.estimate_normals(o3d.geometry.KDTreeSearchParamKNN(neighbours))
    points.orient_normals_towards_camera_location(np.asarray(viewpoint_m, dtype=np.float64))
    return replace(cloud, normals=np.array(points.normals))
