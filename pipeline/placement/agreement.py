"""Agreement of two cameras' measurements at a relative pose."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pipeline.kernels.geometry import apply, project
from pipeline.registration.visibility import BEHIND
from pipeline.types import CameraIntrinsics, DepthMap, FloatArray, PointCloud

WITHIN = 0.02
"""Two measurements that differ by less than this share of the depth belong to the same surface."""
COMPARED_POINTS = 4000
"""Largest number of a cloud's points that are compared with another camera's image."""


@dataclass(frozen=True, slots=True)
class Agreement:
    """Agreement of two cameras' measurements, counted in the points of one or of both."""

    points: int
    """Number of points compared with the other camera's image."""
    shared: int
    """Number of these at pixels that the other camera also measured, and not well behind its surface."""
    within: int
    """Number of shared points within 2 % of the other camera's depth."""

    @property
    def overlap_share(self) -> float:
        """Share of the points that the other camera can judge, 0 to 1."""
        return self.shared / max(1, self.points)

    @property
    def within_2pct_share(self) -> float:
        """Share of the shared points within 2 %; NaN if there are none."""
        return self.within / self.shared if self.shared else float("nan")

    def __add__(self, other: Agreement) -> Agreement:
        """Add the counts."""
        return Agreement(self.points + other.points, self.shared + other.shared, self.within + other.within)


NOTHING_SHARED = Agreement(0, 0, 0)


def agreement(
    cloud: PointCloud, T_camera_cloud: FloatArray, intrinsics: CameraIntrinsics, depth: DepthMap
) -> Agreement:
    """Compare a cloud's points with another camera's measurements.

    A point well behind the measured surface is hidden and does not count. A point in front of it contradicts
    the pose, because the camera saw through its place; this detects wrong poses at which nearest points fit.

    Args:
        cloud: measured points in any frame, of which those of ``compared_points`` are compared.
        T_camera_cloud: (4, 4) from that frame to the other camera's.
        intrinsics: the other camera.
        depth: the other camera's measured depth.
    """
    compared_m = compared_points(cloud).points_m
    points_m = apply(T_camera_cloud, compared_m)
    points_m = points_m[points_m[:, 2] > 1e-6]
    pixels = np.rint(project(intrinsics, points_m))
    inside = np.all((pixels >= 0) & (pixels < (intrinsics.width_px, intrinsics.height_px)), axis=1)
    u, v = pixels[inside].astype(np.int64).T
    ratio = points_m[inside, 2] / depth.z_m[v, u]
    shared = ratio[ratio <= BEHIND]  # excludes NaN, where nothing was measured
    return Agreement(len(compared_m), len(shared), int(np.count_nonzero(np.abs(shared - 1.0) <= WITHIN)))


def compared_points(cloud: PointCloud) -> PointCloud:
    """Return at most ``COMPARED_POINTS`` points of a cloud, evenly selected, without other columns."""
    return PointCloud(cloud.points_m[:: max(1, -(-len(cloud) // COMPARED_POINTS))])
