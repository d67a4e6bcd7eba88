"""Lens models: projection of points, rays of pixels, and the derivatives for calibration (SPEC 1.1)."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from pipeline.config import Lens
from pipeline.kernels.geometry import undistorted_rays
from pipeline.types import CameraIntrinsics, FloatArray

FLAGS: dict[Lens, int] = {
    "thesis": cv2.CALIB_FIX_K3 | cv2.CALIB_ZERO_TANGENT_DIST,
    "brown": 0,
    "rational": cv2.CALIB_RATIONAL_MODEL,
}
"""OpenCV's flags: k1, k2 for thesis (SPEC 1.1); brown adds p1, p2, k3; rational adds k4, k5, k6."""
NAMES = ("fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6")
"""Names of the parameters, in OpenCV's order."""
FREE: dict[Lens, tuple[str, ...]] = {
    "thesis": NAMES[:6],
    "brown": NAMES[:9],
    "rational": NAMES,
    "fisheye": ("fx", "fy", "cx", "cy", "k1", "k2", "k3", "k4"),
}
"""Parameters that a calibration estimates."""


@dataclass(frozen=True, slots=True)
class Projection:
    """Projected points and their derivatives."""

    points_px: FloatArray
    """(N, 2)"""
    by_pose: FloatArray
    """(2 N, 6) derivatives by the points' pose: OpenCV's rotation vector (radians), then translation (m)."""
    by_lens: FloatArray
    """(2 N, P) derivatives by the lens's free parameters."""


@dataclass(frozen=True, slots=True)
class Optics:
    """A lens model with its parameters."""

    lens: Lens
    matrix: FloatArray
    """(3, 3) K."""
    distortion: FloatArray
    """k1, k2, p1, p2, k3, with a rational lens also k4, k5, k6; for a fisheye k1 to k4 (Kannala and Brandt,
    "A generic camera model", PAMI 2006)."""

    def project(self, points_m: FloatArray, T_camera_points: FloatArray | None = None) -> FloatArray:
        """Project (N, 3) points, first transformed to the camera's frame, to (N, 2) pixels."""
        return self.linearised(points_m, T_camera_points).points_px

    def linearised(self, points_m: FloatArray, T_camera_points: FloatArray | None = None) -> Projection:
        """Project points as ``project`` does, with derivatives."""
        if not len(points_m):
            return Projection(np.empty((0, 2)), np.empty((0, 6)), np.empty((0, len(FREE[self.lens]))))
        T = np.eye(4) if T_camera_points is None else T_camera_points
        turn, move = cv2.Rodrigues(T[:3, :3])[0], np.ascontiguousarray(T[:3, 3], float)
        points_m = np.ascontiguousarray(points_m, dtype=np.float64)
        if self.lens == "fisheye":
            seen, J = cv2.fisheye.projectPoints(points_m[None], turn, move, self.matrix, self.distortion)
            return Projection(seen.reshape(-1, 2), J[:, 8:14], J[:, :8])
        seen, J = cv2.projectPoints(points_m, turn, move, self.matrix, self.distortion)
        columns = [6 + NAMES.index(name) for name in FREE[self.lens]]
        return Projection(seen.reshape(-1, 2), J[:, :6], J[:, columns])

    def rays(self, points_px: FloatArray) -> FloatArray:
        """Return (N, 3) unit directions of (N, 2) pixels; NaN where the lens model has none, as for a
        fisheye at 90° or more to the axis.
        """
        camera = CameraIntrinsics(self.matrix, self.distortion.ravel(), 0, 0, self.lens == "fisheye")
        rays = undistorted_rays(camera, points_px)
        return rays / np.linalg.norm(rays, axis=1, keepdims=True)
