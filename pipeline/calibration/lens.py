"""Lens models: projection of points, rays of pixels, and their derivatives by the parameters (SPEC 1.1)."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from pipeline.config import Lens
from pipeline.types import BoolArray, FloatArray

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
WIDEST_DEG = 89.0
"""Largest angle from the optical axis: points beyond it are not in front of the camera."""
_MISSED_PX = 0.01
"""A ray that projects farther than this from its pixel is invalid: the lens model folds there."""
_PATH = 9
"""Points between axis and ray at which the lens model is tested for folding."""
_NEWTON_STEPS, _LONGEST_STEP = 20, 0.3


@dataclass(frozen=True, slots=True)
class Projection:
    """Projected points and their derivatives."""

    points_px: FloatArray
    """(N, 2)"""
    by_pose: FloatArray
    """(2 N, 6) derivatives by OpenCV's rotation vector and translation of the points' pose."""
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
        """Return (N, 3) unit directions of (N, 2) pixels; NaN where the lens model has none."""
        flat = self._flat_fisheye(points_px) if self.lens == "fisheye" else self._flat(points_px)
        rays = np.column_stack([flat, np.ones(len(flat))])
        known = np.flatnonzero(np.isfinite(flat).all(axis=1))
        missed_px = np.linalg.norm(self.project(rays[known]) - points_px[known], axis=1)
        good = known[(missed_px < _MISSED_PX) & self._unfolded(rays[known])]
        rays[np.setdiff1d(np.arange(len(rays)), good)] = np.nan
        return rays / np.linalg.norm(rays, axis=1, keepdims=True)

    def _unfolded(self, rays: FloatArray) -> BoolArray:
        """Return (N,) True where the projection does not fold between axis and (N, 3) rays with z = 1."""
        grows = np.ones(len(rays), bool)
        for share in np.linspace(0.0, 1.0, _PATH):
            grows &= np.linalg.det(self._slopes(rays * (share, share, 1.0))[1]) > 0.0
        return grows

    def _slopes(self, rays: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return (N, 2) pixels of (N, 3) rays with z = 1, and their (N, 2, 2) derivatives by x and y."""
        linear = self.linearised(rays)
        return linear.points_px, linear.by_pose.reshape(-1, 2, 6)[:, :, 3:5]

    def _flat(self, points_px: FloatArray) -> FloatArray:
        """Return (N, 2) points of pixels on the plane z = 1, by Newton's method."""
        flat = (points_px - self.matrix[:2, 2]) / self.matrix[[0, 1], [0, 1]]
        for _ in range(_NEWTON_STEPS):
            seen_px, slopes = self._slopes(np.column_stack([flat, np.ones(len(flat))]))
            slopes[np.abs(np.linalg.det(slopes)) < 1.0] = self.matrix[:2, :2]
            step = np.linalg.solve(slopes, (points_px - seen_px)[:, :, None])[:, :, 0]
            flat = flat + np.clip(step, -_LONGEST_STEP, _LONGEST_STEP)
        return flat

    def _flat_fisheye(self, points_px: FloatArray) -> FloatArray:
        """Return (N, 2) points of pixels on the plane z = 1, by Newton's method for the angle to the axis."""
        bent = (points_px - self.matrix[:2, 2]) / self.matrix[[0, 1], [0, 1]]
        reach = np.linalg.norm(bent, axis=1)
        odd = np.array([1.0, *self.distortion.ravel()])
        angle = np.minimum(reach, np.radians(WIDEST_DEG))
        for _ in range(_NEWTON_STEPS):
            powers = angle[:, None] ** np.arange(0, 10, 2)
            slope = powers @ (odd * np.arange(1, 10, 2))
            angle = angle - (angle * (powers @ odd) - reach) / np.where(slope > 1e-6, slope, np.nan)
        angle[~((angle >= 0.0) & (angle <= np.radians(WIDEST_DEG)))] = np.nan
        return bent * np.divide(np.tan(angle), reach, out=np.ones_like(reach), where=reach > 0.0)[:, None]
