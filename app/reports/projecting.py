"""Projection and drawing of points from a page's first viewpoint, without a display."""

from __future__ import annotations

import numpy as np

from app.reports.hand_out import ASPECT, FIELD_RAD, Viewpoint
from pipeline.kernels.rays import Camera
from pipeline.types import ByteArray, CameraIntrinsics, FloatArray


def camera_of(view: Viewpoint, size_px: tuple[int, int]) -> Camera:
    """Return the camera of a (width, height) picture that shows all that the page shows at first."""
    ahead = view.middle_m - view.eye_m
    ahead /= np.linalg.norm(ahead)
    right = np.cross(ahead, view.up)
    right /= np.linalg.norm(right)
    T_world_camera = np.eye(4)
    T_world_camera[:3, :3] = np.column_stack([right, np.cross(ahead, right), ahead])
    T_world_camera[:3, 3] = view.eye_m
    width_px, height_px = size_px
    focal_px = 0.5 * min(height_px, width_px / ASPECT) / np.tan(0.5 * FIELD_RAD)
    middle = 0.5 * (width_px - 1), 0.5 * (height_px - 1)
    return Camera(CameraIntrinsics.pinhole(focal_px, focal_px, *middle, width_px, height_px), T_world_camera)


def project(points_m: FloatArray, camera: Camera) -> tuple[FloatArray, FloatArray]:
    """Project (N, 3) world points without distortion. Returns (N, 2) pixels and (N,) depths, metres."""
    T = camera.T_world_camera
    seen = (points_m - T[:3, 3]) @ T[:3, :3] @ camera.intrinsics.matrix.T
    return seen[:, :2] / seen[:, 2:], seen[:, 2]


def splat(picture: ByteArray, points_m: FloatArray, colors: ByteArray, camera: Camera, size_px: int) -> None:
    """Draw (N, 3) world points in (N, 3) colours as squares of this size into (H, W, 3), the nearest last."""
    at, depth_m = project(points_m, camera)
    order = np.argsort(-depth_m, kind="stable")
    column, row = np.rint(at[order] - 0.5 * (size_px - 1)).astype(int).T
    height, width = picture.shape[:2]
    steps = np.stack(np.meshgrid(np.arange(size_px), np.arange(size_px)), axis=-1).reshape(-1, 2)
    columns, rows = column[:, None] + steps[:, 0], row[:, None] + steps[:, 1]
    inside = (columns >= 0) & (columns < width) & (rows >= 0) & (rows < height)
    picture[rows[inside], columns[inside]] = np.repeat(colors[order], len(steps), axis=0)[inside.ravel()]
