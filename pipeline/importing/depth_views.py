"""Depth views and frames of a recording, from images that were read and their cameras."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import lru_cache

import cv2
import numpy as np

from pipeline.io.depth_to_color import register_depth
from pipeline.kernels.geometry import LEVEL_POSE, pixel_rays, project
from pipeline.types import ByteArray, CameraIntrinsics, DepthMap, DepthNoise, FloatArray, RgbdFrame

KINECT = DepthNoise(s0_m=0.0012, s1_m=0.0015, p=2.0, q=1.0)
"""Noise that is assumed for every sensor: within a tenth of ``acquisition.depth_sigma_m`` from 1.5 to 4 m."""


@dataclass(frozen=True, slots=True)
class DepthView:
    """A depth image without distortion, with its camera."""

    depth: DepthMap
    """(H, W) metric."""
    camera: CameraIntrinsics
    """Pinhole camera of the same pixels."""
    T_color_depth: FloatArray
    """(4, 4) pose of this camera in the colour camera's frame, metres."""
    noise: DepthNoise
    """Law of the depth's standard deviation."""


@dataclass(frozen=True, slots=True)
class DepthCamera:
    """Camera of depth images."""

    camera: CameraIntrinsics
    """Camera, with its distortion."""
    T_color_depth: FloatArray
    """(4, 4) pose of this camera in the colour camera's frame, metres."""


def view_of(z_m: FloatArray, depth_camera: DepthCamera) -> DepthView:
    """Return a depth image without its distortion.

    Args:
        z_m: (H, W) depth, metres; NaN where it is unknown.
        depth_camera: its camera.
    """
    straight, pixels = _straight(depth_camera.camera)
    z_m = z_m if pixels is None else _moved(z_m, pixels)
    return DepthView(DepthMap(z_m), straight, depth_camera.T_color_depth, KINECT)


def frame_of(
    index: int,
    rgb: ByteArray,
    camera: CameraIntrinsics,
    depth: DepthMap,
    depth_camera: DepthCamera | None,
    T_world_camera: FloatArray | None,
) -> RgbdFrame:
    """Return colour and depth on one pixel grid.

    Args:
        index: number of the frame.
        rgb: (H, W, 3) colours.
        camera: their camera.
        depth: (H, W), or (h, w) of another camera.
        depth_camera: that camera, whose depth is registered to colour; None if depth is on the colour's grid.
        T_world_camera: (4, 4) pose of the colour camera, metres; None if it is unknown.
    """
    if depth_camera is not None:
        depth = register_depth(depth, depth_camera.camera, camera, depth_camera.T_color_depth)
    T = LEVEL_POSE if T_world_camera is None else T_world_camera
    return RgbdFrame(f"frame_{index:05d}", rgb, depth, camera, T, pose_known=T_world_camera is not None)


def unreadable_note(unreadable: Mapping[int, str]) -> tuple[str, ...]:
    """Return a sentence on depth images that could not be read, by their errors; none if all could."""
    if not unreadable:
        return ()
    first = unreadable[min(unreadable)]
    return (f"{len(unreadable)} depth images were left out, the first because: {first}",)


def _straight(camera: CameraIntrinsics) -> tuple[CameraIntrinsics, FloatArray | None]:
    """Return a camera without its distortion, and (H, W, 2) its pixels in the distorted image."""
    if not camera.fisheye and not np.any(camera.distortion):
        return camera, None
    straight = replace(camera, distortion=np.zeros(5), fisheye=False)
    values = camera.matrix.tobytes(), camera.distortion.tobytes()
    return straight, _distorted(*values, camera.width_px, camera.height_px, camera.fisheye)


@lru_cache(maxsize=2)
def _distorted(matrix: bytes, distortion: bytes, width_px: int, height_px: int, fisheye: bool) -> FloatArray:
    """Return (H, W, 2) float32 pixels in the distorted image of the pixels of the straight one."""
    own = np.frombuffer(matrix).reshape(3, 3)
    camera = CameraIntrinsics(own, np.frombuffer(distortion), width_px, height_px, fisheye)
    straight = CameraIntrinsics(own, np.zeros(5), width_px, height_px)
    pixels = project(camera, pixel_rays(straight).reshape(-1, 3))
    return np.nan_to_num(pixels, nan=-10.0).astype(np.float32).reshape(height_px, width_px, 2)


def _moved(z_m: FloatArray, pixels: FloatArray) -> FloatArray:
    """Return (H, W) depth at (H, W, 2) pixels of an image, each from the nearest pixel; NaN outside."""
    moved: FloatArray = cv2.remap(
        z_m,
        pixels[..., 0],
        pixels[..., 1],
        cv2.INTER_NEAREST,
        borderMode=cv2.BORDER_CONSTANT,
        borderValue=np.nan,
    )
    return moved
