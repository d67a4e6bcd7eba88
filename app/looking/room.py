"""Extent of a scene, height of its ceiling, and whether its up direction is known; needed to place cuts."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from app.compute.records import SceneView
from pipeline.kernels.geometry import LEVEL_POSE, apply
from pipeline.types import FloatArray

INNER = (1.0, 99.0)
"""Percentiles of the points' coordinates that bound the extent."""
BELOW_M = 0.1
"""Distance of a cut below the ceiling."""
ABOVE_M = 0.1
"""Least height of a ceiling above the highest camera."""
LAYER_M = 0.1
"""Height of a layer of points, and the size of the cells in which its area is counted."""
CLEAR_LAYERS = 3
"""Number of layers below a cell of a ceiling that have no points; below a cell of a wall they have some."""
LEAST_M2 = 1.0
"""Least area of a ceiling's seen part, square metres."""
MOST_OVER = 0.02
"""Largest share of the points that may be above a ceiling: seen through a window, or flying."""


@dataclass(frozen=True, slots=True)
class Room:
    """The extent of what a scene's cameras saw, in its world frame."""

    low_m: FloatArray
    """(3,) lowest coordinates."""
    high_m: FloatArray
    """(3,) highest coordinates."""
    ceiling_m: float | None
    """Height just below the ceiling; None if none was seen."""
    upright: bool
    """Whether +z is known to be up."""

    @property
    def centre_m(self) -> FloatArray:
        """(3,) middle of the extent."""
        return 0.5 * (self.low_m + self.high_m)

    @property
    def size_m(self) -> FloatArray:
        """(3,) lengths of the extent."""
        return np.maximum(self.high_m - self.low_m, 0.01)


def room_of(view: SceneView) -> Room:
    """Return the room of a scene."""
    poses = [node.T_world_camera for node in view.nodes]
    clouds_m = [apply(node.T_world_camera, node.sensor.points_m.astype(float)) for node in view.nodes]
    points_m = np.concatenate(clouds_m)
    upright = not all(np.array_equal(pose, LEVEL_POSE) for pose in poses)
    cameras_m = np.array([pose[:3, 3] for pose in poses])
    if not len(points_m):
        return Room(cameras_m.min(axis=0) - 1.0, cameras_m.max(axis=0) + 1.0, None, upright)
    low_m, high_m = np.percentile(points_m, INNER, axis=0)
    ceiling_m = ceiling_of(points_m, float(cameras_m[:, 2].max())) if upright else None
    return Room(low_m, high_m, ceiling_m, upright)


def ceiling_of(points_m: FloatArray, camera_m: float) -> float | None:
    """Return a height just below the ceiling; None if none was seen.

    A ceiling is the layer above all cameras with the largest area that has nothing right below it.

    Args:
        points_m: (N, 3) points, z up.
        camera_m: height of the highest camera.
    """
    count = len(points_m)
    points_m = points_m[points_m[:, 2] > camera_m + ABOVE_M - (CLEAR_LAYERS + 1) * LAYER_M]
    if not len(points_m):
        return None
    low_m = points_m[:, :2].min(axis=0)
    cells = ((points_m[:, :2] - low_m) / LAYER_M).astype(np.int64)
    cell = cells[:, 0] * (cells[:, 1].max() + 1) + cells[:, 1]
    best_m2, best_m = 0.0, 0.0
    half_m = 0.5 * LAYER_M
    for floor_m in np.arange(camera_m + ABOVE_M, points_m[:, 2].max(), half_m):
        height_m = points_m[:, 2] - floor_m
        layer = (height_m >= 0.0) & (height_m < LAYER_M)
        below = (height_m < -half_m) & (height_m >= -half_m - CLEAR_LAYERS * LAYER_M)
        clear = np.setdiff1d(cell[layer], cell[below])
        area_m2 = len(clear) * LAYER_M**2
        if area_m2 > best_m2 and np.sum(height_m >= 2.0 * LAYER_M) <= MOST_OVER * count:
            best_m2, best_m = area_m2, float(np.median(points_m[layer & np.isin(cell, clear), 2]))
    return best_m - BELOW_M if best_m2 >= LEAST_M2 else None
