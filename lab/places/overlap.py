"""Overlap of two camera views of one room, from its true surface."""

from __future__ import annotations

import numpy as np

from lab.worlds.pixels import camera_rays
from lab.worlds.raycast import Hits, RayCaster
from lab.worlds.sensor import SensorConfig
from pipeline.kernels.geometry import apply, inverse, project, scaled
from pipeline.types import BoolArray, CameraIntrinsics, FloatArray

COARSE = 0.2
"""Overlap is measured on images of this size relative to the camera's: 64 x 48 of 320 x 240 pixels."""
SAME_SURFACE_M = 0.02
"""A point is hidden from the other camera if its ray meets something nearer, by more than this."""
RANGE_M = (SensorConfig().near_m, SensorConfig().far_m)
"""Depths that the sensor measures."""


class OverlapMeter:
    """Measures the overlap of views of one room by one camera.

    Args:
        caster: the room's surface.
        intrinsics: the camera, at full size.
    """

    def __init__(self, caster: RayCaster, intrinsics: CameraIntrinsics) -> None:
        self._caster = caster
        self._coarse = scaled(intrinsics, COARSE)

    def look(self, T_world_camera: FloatArray) -> Hits:
        """Return what a camera at the (4, 4) pose sees, on the coarse image; ``t`` is the depth z, metres."""
        return self._caster.cast(camera_rays(self._coarse, T_world_camera))

    def share(self, T_a: FloatArray, a: Hits, T_b: FloatArray, b: Hits) -> float:
        """Return the overlap of two views, 0 to 1: the smaller of both directed shares.

        A directed share is the share of the surface points that one camera measures (true depth within the
        sensor's range, holes not considered) that the other one measures too: in its image, within its range,
        and not hidden. So an overlap of 0.25 means that each view shares at least a quarter of its points.

        Args:
            T_a: (4, 4) pose T_world_camera of the first view.
            a: what it sees, from ``look``.
            T_b: pose of the second view.
            b: what it sees.
        """
        return min(self._directed(a, T_b), self._directed(b, T_a))

    def _directed(self, seen: Hits, T_other: FloatArray) -> float:
        points_m = seen.positions[in_range(seen.t)].astype(np.float64)
        if not len(points_m):
            return 0.0
        local_m = apply(inverse(T_other), points_m)
        inside = np.flatnonzero(in_range(local_m[:, 2]))
        pixels = project(self._coarse, local_m[inside])
        inside = inside[_in_image(pixels, self._coarse)]
        if not len(inside):
            return 0.0
        eye_m = T_other[:3, 3]
        rays = np.empty((len(inside), 6), np.float32)
        rays[:, :3] = eye_m
        rays[:, 3:] = points_m[inside] - eye_m
        reach = 1.0 - SAME_SURFACE_M / np.linalg.norm(rays[:, 3:], axis=1)
        return float(np.sum(self._caster.cast(rays).t >= reach) / len(points_m))


def in_range(z_m: FloatArray) -> BoolArray:
    """Return a mask of the depths that the sensor measures."""
    return (z_m >= RANGE_M[0]) & (z_m <= RANGE_M[1])


def _in_image(pixels: FloatArray, intrinsics: CameraIntrinsics) -> BoolArray:
    """Return (N,) whether (N, 2) pixels are in the image, whose outer pixel centres are 0 and size - 1."""
    size = np.array([intrinsics.width_px, intrinsics.height_px])
    return np.all((pixels >= -0.5) & (pixels <= size - 0.5), axis=1)
