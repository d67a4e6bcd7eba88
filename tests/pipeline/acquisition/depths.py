"""Depth images of simple things, exact or as the sensor model reports them."""

import numpy as np

from lab.worlds.render import View
from lab.worlds.sensor import SensorConfig, axial_sigma_m, sense_depth
from pipeline.kernels.geometry import pixel_rays
from pipeline.types import CameraIntrinsics, DepthMap

CAMERA = CameraIntrinsics.pinhole(262.5, 262.5, 159.5, 119.5, 320, 240)
STEP = SensorConfig().disparity_step_px / (525.0 * SensorConfig().baseline_m)
"""Of 1/z, 1/m, as the sensor model takes it for a field of view like this."""


def plane(normal, offset_m: float) -> tuple[np.ndarray, np.ndarray]:
    """(H, W) depth of the plane normal . x = offset and (H, W, 3) its unit normals; NaN where behind."""
    normal = np.asarray(normal, float) / np.linalg.norm(normal)
    along = pixel_rays(CAMERA) @ normal
    z_m = np.where(offset_m / along > 0, offset_m / along, np.nan)
    return z_m, np.broadcast_to(normal, (*z_m.shape, 3))


def wall(angle_deg: float, distance_m: float) -> tuple[np.ndarray, np.ndarray]:
    """A wall turned from facing the camera, so far away on the axis."""
    angle = np.radians(angle_deg)
    return plane((np.sin(angle), 0.0, np.cos(angle)), distance_m * np.cos(angle))


def box(z_m: float, rows: slice, columns: slice) -> tuple[np.ndarray, np.ndarray]:
    """A board that faces the camera and covers some pixels."""
    depth = np.full((CAMERA.height_px, CAMERA.width_px), np.nan)
    depth[rows, columns] = z_m
    return depth, np.broadcast_to([0.0, 0.0, 1.0], (*depth.shape, 3))


def nearest(*things) -> tuple[np.ndarray, np.ndarray]:
    """What is seen of several things."""
    depths = np.stack([np.where(np.isfinite(z_m), z_m, np.inf) for z_m, _ in things])
    first = depths.argmin(axis=0)
    normals = np.choose(first[..., None], [normal for _, normal in things])
    z_m = depths.min(axis=0)
    return np.where(np.isfinite(z_m), z_m, np.nan), normals


def sensed(z_m: np.ndarray, normals: np.ndarray, seed: int, **config) -> DepthMap:
    """What a Kinect reports of it."""
    shape = z_m.shape
    view = View(
        np.zeros((*shape, 3), np.uint8), z_m, normals, np.full(shape, 0.6), np.zeros(shape), np.eye(4)
    )
    return sense_depth(view, CAMERA, np.random.default_rng(seed), SensorConfig(**config))


def in_steps(z_m: np.ndarray) -> DepthMap:
    """Without noise, in a Kinect's steps of disparity."""
    return DepthMap((1.0 / (np.rint(1.0 / z_m / STEP) * STEP)).astype(np.float32))


def off_everything(depth: DepthMap, true_m: np.ndarray) -> np.ndarray:
    """(H, W) measured pixels that are farther from all that is there, within two pixels, than noise goes."""
    z_m = depth.z_m.astype(float)
    noise = 3.0 * axial_sigma_m(z_m) / z_m**2 + STEP
    around = np.lib.stride_tricks.sliding_window_view(np.pad(1.0 / true_m, 2, mode="edge"), (5, 5))
    apart = np.abs(around - (1.0 / z_m)[..., None, None])
    return depth.valid & (np.nan_to_num(apart, nan=np.inf).min(axis=(2, 3)) > noise)
