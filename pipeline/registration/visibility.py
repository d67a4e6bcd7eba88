"""Which of a node's points another node's sensor can judge."""

from __future__ import annotations

import numpy as np

from pipeline.kernels.geometry import apply, project
from pipeline.types import BoolArray, CameraIntrinsics, DepthMap, FloatArray, PointCloud

BEHIND = 1.1
"""How much deeper than the measured surface a point must be to count as hidden by it; nearer ones are
guesses about a surface that the sensor has measured."""


def hidden_from(
    cloud: PointCloud, T_camera_cloud: FloatArray, intrinsics: CameraIntrinsics, depth: DepthMap
) -> BoolArray:
    """(N,) True for the points that another camera's sensor cannot confirm or refute.

    Those are outside its image, at pixels without depth, or well behind what it measured. The other
    points lie on a measured surface, or float in front of it where the sensor sees through them.

    Args:
        cloud: points in any frame.
        T_camera_cloud: (4, 4) from that frame to the other camera's.
        intrinsics: the other camera.
        depth: what its sensor measured.
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
