"""Viewpoints for pictures of a cloud or a surface without a given camera."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pipeline.kernels.geometry import rigid
from pipeline.kernels.rays import Camera
from pipeline.types import BoolArray, CameraIntrinsics, FloatArray, PointCloud

FOV_RAD = float(np.radians(50.0))
"""Vertical field of view."""
SMALLEST_M = 0.01
"""Least radius of the sphere that fills the picture."""
OBLIQUE = (-0.6, -0.7, 0.5)
"""Direction towards the viewpoint, if the normals do not show from which side the points were seen."""
ABOVE = 0.4
"""Height over distance that is added to a direction, to look down."""
LEAST_SIDE = 0.2
"""Shorter mean normals belong to surfaces that face all sides."""
STRAIGHT = 0.99
"""Correlation of pixels with x/z and y/z above which points are in the frame of the camera that saw them."""
LEAST_POINTS = 10
"""Fewer points do not show whether they are in their camera's frame."""


@dataclass(frozen=True, slots=True)
class View:
    """A viewpoint, a target and the upward direction, all in the frame of the points."""

    position_m: FloatArray
    """(3,)."""
    look_at_m: FloatArray
    """(3,)."""
    up: FloatArray
    """(3,) unit vector of the picture's upward direction."""
    fov_rad: float = FOV_RAD
    """Vertical field of view."""

    def camera(self, width_px: int, height_px: int) -> Camera:
        """Return a pinhole camera at the viewpoint; its pose is in the frame of the points."""
        forward = _unit(self.look_at_m - self.position_m)
        right = _unit(np.cross(forward, self.up))
        T = rigid(np.stack([right, np.cross(forward, right), forward], axis=1), self.position_m)
        focal_px = 0.5 * height_px / float(np.tan(0.5 * self.fov_rad))
        middle_px = 0.5 * (width_px - 1), 0.5 * (height_px - 1)
        return Camera(CameraIntrinsics.pinhole(focal_px, focal_px, *middle_px, width_px, height_px), T)


def view_of(points_m: FloatArray, normals: FloatArray | None = None, in_camera: bool = False) -> View:
    """Return the view of (N, 3) points from the side that was seen, from as far as they need.

    Args:
        points_m: at least one point.
        normals: (N, 3) unit vectors towards the cameras that saw the points; None if unknown.
        in_camera: whether the points are in the frame of the camera that saw them: y is down there. In
            other frames z is up.
    """
    up = np.array([0.0, -1.0, 0.0] if in_camera else [0.0, 0.0, 1.0])
    towards = np.array(OBLIQUE)
    if in_camera:
        towards = np.array([0.0, 0.0, -1.0])
    elif normals is not None and len(normals):
        side = normals.mean(axis=0) * (1.0 - up)
        towards = side if np.linalg.norm(side) > LEAST_SIDE else towards
    towards = _unit(_unit(towards) + ABOVE * up)
    low_m, high_m = np.percentile(points_m, [1, 99], axis=0)
    middle_m = 0.5 * (low_m + high_m)
    radius_m = float(np.percentile(np.linalg.norm(points_m - middle_m, axis=1), 98))
    away_m = max(radius_m, SMALLEST_M) / float(np.sin(0.5 * FOV_RAD))
    return View(middle_m + away_m * towards, middle_m, up)


def in_its_camera(cloud: PointCloud) -> bool:
    """Return whether a cloud is in the frame of the camera that saw it, by its pixels."""
    if cloud.pixels is None or len(cloud) < LEAST_POINTS or not (cloud.points_m[:, 2] > 0.0).all():
        return False
    places = cloud.points_m[:, :2] / cloud.points_m[:, 2:]
    with np.errstate(invalid="ignore", divide="ignore"):
        agree: BoolArray = np.array(
            [np.corrcoef(places[:, axis], cloud.pixels[:, axis])[0, 1] > STRAIGHT for axis in (0, 1)]
        )
    return bool(agree.all())


def _unit(vector: FloatArray) -> FloatArray:
    return vector / max(float(np.linalg.norm(vector)), 1e-12)
