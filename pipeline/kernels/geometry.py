"""Rigid motions, and cameras: pixels to rays and points to pixels."""

import math
from dataclasses import replace
from functools import lru_cache

import cv2
import numpy as np
from numpy.typing import ArrayLike

from pipeline.kernels.lens import distorted, reach, straightened
from pipeline.types import BoolArray, CameraIntrinsics, FloatArray

STEEPEST_DEG = 89.0
"""Largest tilt of ``aimed``."""


def rigid(rotation: FloatArray, translation_m: FloatArray) -> FloatArray:
    """Return the (4, 4) transform x -> rotation @ x + translation."""
    T = np.eye(4)
    T[:3, :3] = rotation
    T[:3, 3] = translation_m
    return T


def inverse(T_a_b: FloatArray) -> FloatArray:
    """Return T_b_a, the inverse of a rigid (4, 4) transform, by transposing its rotation."""
    rotation = T_a_b[:3, :3].T
    return rigid(rotation, -rotation @ T_a_b[:3, 3])


def orthonormal(T_a_b: FloatArray) -> FloatArray:
    """Return a (4, 4) pose without the rounding errors of its rotation, which grow with each product."""
    left, _, right = np.linalg.svd(T_a_b[:3, :3])
    return rigid(left @ right, T_a_b[:3, 3])


def apply(T_a_b: FloatArray, points_m: FloatArray) -> FloatArray:
    """Transform (N, 3) points from frame b to frame a."""
    moved_m = points_m @ T_a_b[:3, :3].T
    moved_m += T_a_b[:3, 3]
    return moved_m


def rotation_exp(omega_rad: FloatArray) -> FloatArray:
    """Return the (3, 3) rotation about the axis ``omega_rad`` (3,) by its length (Rodrigues)."""
    return cv2.Rodrigues(np.asarray(omega_rad, dtype=np.float64))[0]


def rotation_angle_rad(rotation: FloatArray) -> float:
    """Return the angle of a (3, 3) rotation, accurate near zero and near pi."""
    skew = rotation - rotation.T
    sine = 0.5 * math.hypot(skew[2, 1], skew[0, 2], skew[1, 0])
    return math.atan2(sine, 0.5 * (rotation[0, 0] + rotation[1, 1] + rotation[2, 2] - 1.0))


def look_at(eye_m: ArrayLike, target_m: ArrayLike, up: ArrayLike = (0.0, 0.0, 1.0)) -> FloatArray:
    """Return T_world_camera of a camera at ``eye_m`` that looks at ``target_m``.

    ``up`` is the world's upward direction; it must not be parallel to the view.
    """
    eye_m = np.asarray(eye_m, float)
    forward = np.asarray(target_m, float) - eye_m
    forward /= np.linalg.norm(forward)
    right = np.cross(forward, np.asarray(up, float))
    right /= np.linalg.norm(right)
    return rigid(np.stack([right, np.cross(forward, right), forward], axis=1), eye_m)


def aim_deg(T_world_camera: FloatArray) -> tuple[float, float]:
    """Return a camera's pan and tilt.

    Pan is the angle of its view on the floor plan, from the x axis counter-clockwise, 0 to 360 degrees; tilt
    the angle above the horizon, negative for a view downwards.
    """
    ahead = T_world_camera[:3, 2]
    pan_deg = np.degrees(np.arctan2(ahead[1], ahead[0])) % 360.0
    return float(pan_deg), float(np.degrees(np.arcsin(np.clip(ahead[2], -1.0, 1.0))))


def aimed(eye_m: ArrayLike, pan_deg: float, tilt_deg: float) -> FloatArray:
    """Return T_world_camera of a level camera at ``eye_m`` with the pan and tilt of ``aim_deg``.

    Tilts beyond ``STEEPEST_DEG`` are cut there, because a camera that looks straight up or down has no pan.
    """
    eye_m = np.asarray(eye_m, float)
    pan = math.radians(pan_deg)
    tilt = math.radians(min(max(tilt_deg, -STEEPEST_DEG), STEEPEST_DEG))
    ahead = (math.cos(tilt) * math.cos(pan), math.cos(tilt) * math.sin(pan), math.sin(tilt))
    return look_at(eye_m, eye_m + ahead)


LEVEL_POSE = look_at(np.zeros(3), np.array([0.0, 1.0, 0.0]))
"""T_world_camera of a camera with unknown pose: at the origin, upright, looking along +y."""


def scaled(intrinsics: CameraIntrinsics, factor: float) -> CameraIntrinsics:
    """Return the camera of an image resized by ``factor``; pixel centres stay at integers."""
    size = round(intrinsics.width_px * factor), round(intrinsics.height_px * factor)
    return _resized(intrinsics, (factor, factor), size)


def scaled_to(intrinsics: CameraIntrinsics, width_px: int, height_px: int) -> CameraIntrinsics | None:
    """Return the camera of an image resized to this size; None if the proportions differ.

    They agree if the height follows from the width, or the width from the height, to the nearest pixel.
    """
    shares = width_px / intrinsics.width_px, height_px / intrinsics.height_px
    if height_px != round(intrinsics.height_px * shares[0]) and width_px != round(
        intrinsics.width_px * shares[1]
    ):
        return None
    return _resized(intrinsics, shares, (width_px, height_px))


def _resized(
    intrinsics: CameraIntrinsics, shares: tuple[float, float], size_px: tuple[int, int]
) -> CameraIntrinsics:
    """Return the camera of an image whose width and height are multiplied by ``shares``, to ``size_px``."""
    matrix = intrinsics.matrix.copy()
    matrix[[0, 1], [0, 1]] *= shares
    matrix[:2, 2] = (matrix[:2, 2] + 0.5) * shares - 0.5
    return replace(intrinsics, matrix=matrix, width_px=size_px[0], height_px=size_px[1])


def pixel_rays(intrinsics: CameraIntrinsics) -> FloatArray:
    """Return (H, W, 3) camera-frame directions of the pixel centres with z = 1, undistorted; read-only.

    Pixels without such a direction are NaN, as in ``undistorted_rays``. The rays of the last four cameras of
    up to ``_KEPT_PX`` pixels are cached: reconstructing one frame calls this five times.
    """
    size = intrinsics.width_px, intrinsics.height_px
    find = _kept_rays if size[0] * size[1] <= _KEPT_PX else _rays
    matrix, distortion = (np.asarray(of, np.float64) for of in (intrinsics.matrix, intrinsics.distortion))
    return find(matrix.tobytes(), distortion.tobytes(), *size, intrinsics.fisheye)


def has_ray(intrinsics: CameraIntrinsics) -> BoolArray:
    """Return (H, W) True for the pixels that have a direction in ``pixel_rays``."""
    if is_pinhole(intrinsics):
        return np.ones((intrinsics.height_px, intrinsics.width_px), dtype=bool)
    return np.isfinite(pixel_rays(intrinsics)[..., 2])


def _rays(matrix: bytes, distortion: bytes, width_px: int, height_px: int, fisheye: bool) -> FloatArray:
    """Compute ``pixel_rays`` of a camera whose parameters are given as bytes of float64."""
    numbers = np.frombuffer(matrix).reshape(3, 3), np.frombuffer(distortion)
    u, v = np.meshgrid(np.arange(width_px), np.arange(height_px))
    pixels = np.stack([u, v], axis=-1).reshape(-1, 2)
    rays = undistorted_rays(CameraIntrinsics(*numbers, width_px, height_px, fisheye), pixels)
    rays.setflags(write=False)
    return rays.reshape(height_px, width_px, 3)


_kept_rays = lru_cache(maxsize=4)(_rays)
_KEPT_PX = 1_000_000
"""Pixels of the largest image whose rays are cached: 24 MB."""


def undistorted_rays(intrinsics: CameraIntrinsics, pixels: ArrayLike) -> FloatArray:
    """Return (N, 3) camera-frame directions with z = 1 of (N, 2) image positions, SPEC 1.1.

    A position that the lens model does not reach, or a fisheye's at 90 degrees or more to the optical axis,
    has no such direction: its row is NaN. The others project to their pixels within 1e-7 pixels.
    """
    pixels = np.asarray(pixels, dtype=np.float64)
    if not len(pixels):
        return np.empty((0, 3))
    if is_pinhole(intrinsics):
        x = (pixels[:, 0] - intrinsics.cx_px) / intrinsics.fx_px
        y = (pixels[:, 1] - intrinsics.cy_px) / intrinsics.fy_px
        return np.stack([x, y, np.ones_like(x)], axis=1)
    xy = straightened(intrinsics, pixels)
    return np.concatenate([xy, np.where(np.isnan(xy[:, :1]), np.nan, 1.0)], axis=1)


def project(intrinsics: CameraIntrinsics, points_m: FloatArray) -> FloatArray:
    """Project (N, 3) camera-frame points in front of the camera to (N, 2) image positions (eq. 3.1-3.3).

    A point beyond the range in which the lens model holds has no image: its row is NaN.
    """
    if not len(points_m):
        return np.empty((0, 2))
    depth_m = points_m[:, 2]
    nearness = np.divide(1.0, depth_m, out=np.ones_like(depth_m), where=depth_m != 0.0)
    if is_pinhole(intrinsics):  # OpenCV would also compute fifty derivatives per point
        u_px = points_m[:, 0] * nearness * intrinsics.fx_px + intrinsics.cx_px
        v_px = points_m[:, 1] * nearness * intrinsics.fy_px + intrinsics.cy_px
        return np.stack([u_px, v_px], axis=1)
    straight = points_m[:, :2] * nearness[:, None]
    if intrinsics.fisheye:
        pixels = distorted(intrinsics, straight) * intrinsics.matrix[[0, 1], [0, 1]]
        pixels += intrinsics.matrix[:2, 2]
    else:
        pixels = cv2.projectPoints(
            np.ascontiguousarray(points_m, dtype=np.float64),
            np.zeros(3),
            np.zeros(3),
            intrinsics.matrix,
            intrinsics.distortion,
        )[0][:, 0]
    pixels[np.hypot(*straight.T) >= reach(intrinsics)] = np.nan
    return pixels


def is_pinhole(intrinsics: CameraIntrinsics) -> bool:
    """Return whether a camera has no distortion."""
    return not intrinsics.fisheye and not np.any(intrinsics.distortion)
