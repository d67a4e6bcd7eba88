"""Whether two cameras measured the same surfaces where one stands beside the other."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pipeline.kernels.geometry import apply, project
from pipeline.registration.visibility import BEHIND
from pipeline.types import CameraIntrinsics, DepthMap, FloatArray, PointCloud

WITHIN = 0.02
"""Two measurements that differ by less than this share of the depth are of the same surface."""
ASKED_POINTS = 4000
"""Points of a cloud that are looked for in another camera's image."""


@dataclass(frozen=True, slots=True)
class Agreement:
    """What two cameras both measured; counted in one's points, or in those of both."""

    points: int
    """That were looked for in the other camera's image."""
    shared: int
    """Of them, those at pixels that the other measured as well, none of them well behind its surface."""
    within: int
    """Of the shared ones, those within 2 % of the other's depth."""

    @property
    def overlap_share(self) -> float:
        """Of the points, those that the other camera can judge, 0 to 1."""
        return self.shared / max(1, self.points)

    @property
    def within_2pct_share(self) -> float:
        """Of what both measured, the share within 2 %; NaN where they share nothing."""
        return self.within / self.shared if self.shared else float("nan")

    def __add__(self, other: Agreement) -> Agreement:
        """Both counts together."""
        return Agreement(self.points + other.points, self.shared + other.shared, self.within + other.within)


NOTHING_SHARED = Agreement(0, 0, 0)


def agreement(
    cloud: PointCloud, T_camera_cloud: FloatArray, intrinsics: CameraIntrinsics, depth: DepthMap
) -> Agreement:
    """How a cloud's points lie beside what another camera measured.

    A point well behind the measured surface is hidden by it and says nothing; one in front of it would have
    been seen. So a pose that piles one place onto another is found out although nearest points fit.

    Args:
        cloud: measured points in any frame; an even choice of at most ``ASKED_POINTS`` of them is asked.
        T_camera_cloud: (4, 4) from that frame to the other camera's.
        intrinsics: the other camera.
        depth: what its sensor measured.
    """
    asked_m = cloud.points_m[:: max(1, -(-len(cloud) // ASKED_POINTS))]
    points_m = apply(T_camera_cloud, asked_m)
    points_m = points_m[points_m[:, 2] > 1e-6]
    pixels = np.rint(project(intrinsics, points_m))
    inside = np.all((pixels >= 0) & (pixels < (intrinsics.width_px, intrinsics.height_px)), axis=1)
    u, v = pixels[inside].astype(np.int64).T
    ratio = points_m[inside, 2] / depth.z_m[v, u]
    shared = ratio[ratio <= BEHIND]  # NaN, where nothing was measured, is not
    return Agreement(len(asked_m), len(shared), int(np.count_nonzero(np.abs(shared - 1.0) <= WITHIN)))
