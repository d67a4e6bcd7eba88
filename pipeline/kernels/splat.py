"""Depth images of clouds: every point covers a square of pixels."""

from __future__ import annotations

import numpy as np

from pipeline.kernels.geometry import apply, inverse, project
from pipeline.kernels.kdtree import compiled
from pipeline.types import CameraIntrinsics, FloatArray


def splat_depth(
    points_m: FloatArray, side_m: float, camera: CameraIntrinsics, T_world_camera: FloatArray
) -> FloatArray:
    """Return (H, W) float32 depth of the nearest square at each pixel, metres; infinite without one.

    Points up to ``side_m`` in front of the camera are left out.

    Args:
        points_m: (N, 3) middles of the squares, world frame.
        side_m: side of the squares, which face the camera.
        camera: camera of the image.
        T_world_camera: (4, 4) its pose.
    """
    own_m = apply(inverse(T_world_camera), points_m)
    own_m = own_m[own_m[:, 2] > side_m]
    pixels = project(camera, own_m)
    known = np.isfinite(pixels).all(axis=1)
    nearest = np.full((camera.height_px, camera.width_px), np.inf, np.float32)
    _splat(pixels[known], own_m[known, 2], 0.5 * side_m * camera.fx_px, nearest)
    return nearest


@compiled
def _splat(pixels: FloatArray, z: FloatArray, reach_z: float, nearest: FloatArray) -> None:
    """Write each point's depth to the pixels of its square that have no nearer depth."""
    height, width = nearest.shape
    for i in range(len(z)):
        reach = reach_z / z[i]
        left, right = max(0.0, np.ceil(pixels[i, 0] - reach)), min(width - 1.0, pixels[i, 0] + reach)
        top, bottom = max(0.0, np.ceil(pixels[i, 1] - reach)), min(height - 1.0, pixels[i, 1] + reach)
        if right < left or bottom < top:
            continue
        for v in range(int(top), int(bottom) + 1):
            for u in range(int(left), int(right) + 1):
                if z[i] < nearest[v, u]:
                    nearest[v, u] = z[i]
