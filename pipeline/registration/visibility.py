"""Visibility test: the points of a node that another node's sensor can confirm or refute."""

from __future__ import annotations

import numpy as np

from pipeline.kernels.geometry import apply, project
from pipeline.types import BoolArray, CameraIntrinsics, DepthMap, FloatArray, PointCloud

BEHIND = 1.1
"""Least ratio of a point's depth to the measured depth for the point to count as hidden; a nearer point is
an estimate of the surface that the sensor has measured."""


def hidden_from(
    cloud: PointCloud, T_camera_cloud: FloatArray, intrinsics: CameraIntrinsics, depth: DepthMap
) -> BoolArray:
    """Return (N,) True for the points that another camera's sensor cannot confirm or refute.

    These points are outside its image, at pixels without depth, or well behind the measured surface. The
    other points are on the measured surface, or in front of it, where the sensor's ray passes through them.

    Args:
        cloud: points in any frame.
        T_camera_cloud: (4, 4) from that frame to the other camera's.
        intrinsics: intrinsics of the other camera.
        depth: depth measured by the other camera's sensor.
    """
    points_m = apply(T_camera_cloud, cloud.points_m)
    hidden = np.ones(len(cloud), dtype=bool)
    ahead = np.flatnonzero(points_m[:, 2] > 1e-6)
    pixels = np.rint(project(intrinsics, points_m[ahead]))
    inside = np.all((pixels >= 0) & (pixels < (intrinsics.width_px, intrinsics.height_px)), axis=1)
    rows, (u, v) = ahead[inside], pixels[inside].astype(np.int64).T
    measured_m = depth.z_m[v, u]
    hidden[rows] = np.isnan(measured_m) | (points_m[rows, 2] > BEHIND * measured_m)
    return hidden
