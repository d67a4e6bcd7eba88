"""The brush that paints discs on a cloud, and the search for the point that was clicked."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import viser

from app.compute.records import Sample
from app.drawing.clouds import add_sensor_cloud
from app.drawing.colors import HOLE
from app.screens.depth.discs import covered, disc_at
from app.screens.depth.view import Disc, SeenSample
from pipeline.types import BoolArray, FloatArray

REACH_DEG = 1.0
"""Largest angle between a click's ray and the point that it selects."""
BEHIND = 0.05
"""Points up to this share farther than the nearest one in reach belong to the same surface."""
LARGER = 1.7
"""Size of a painted point over its own size."""


class BrushDrawing:
    """The painted points of one cloud, large and in the colour of unknown pixels."""

    def __init__(self, scene: viser.SceneApi, name: str) -> None:
        self._scene, self._name = scene, name

    def draw(self, cloud: SeenSample, T_world_camera: FloatArray, discs: Sequence[Disc]) -> None:
        """Replace the drawn points by those under these discs."""
        self._scene.remove_by_name(self._name)
        points_m = cloud.points_m[painted(cloud, discs)]
        if len(points_m):
            sample = Sample(points_m, None, len(points_m), spacing=cloud.spacing)
            add_sensor_cloud(self._scene, self._name, sample, T_world_camera, HOLE, LARGER)


def painted(cloud: SeenSample, discs: Sequence[Disc]) -> BoolArray:
    """Return (N,) whether the discs cover each point of the cloud in its image."""
    return covered(discs, cloud.pixels[:, 0], cloud.pixels[:, 1], cloud.width_px, cloud.height_px)


def clicked_disc(
    cloud: SeenSample,
    T_world_camera: FloatArray,
    origin_m: FloatArray,
    direction: FloatArray,
    size_share: float,
) -> Disc | None:
    """Return the disc around the pixel of the point that a ray selects.

    Args:
        cloud: points in the frame of their camera.
        T_world_camera: (4, 4) pose of that camera.
        origin_m: (3,) origin of the ray, world frame.
        direction: (3,) direction of the ray, world frame, of any length.
        size_share: diameter of the disc over the image's width.

    Returns:
        None if the ray misses the cloud.
    """
    R = T_world_camera[:3, :3]
    index = picked_point(cloud.points_m, (origin_m - T_world_camera[:3, 3]) @ R, direction @ R)
    if index is None:
        return None
    u, v = cloud.pixels[index]
    return disc_at(float(u), float(v), cloud.width_px, cloud.height_px, size_share)


def picked_point(points_m: FloatArray, origin_m: FloatArray, direction: FloatArray) -> int | None:
    """Return the row of the (N, 3) point that a ray selects; None if none is within 1 degree of it.

    Of the points within 1 degree, only those of the nearest surface count, because rays also pass between the
    points of a sparse surface to the one behind it. Of these, the point closest to the ray is selected.
    """
    forward = np.asarray(direction, float) / np.linalg.norm(direction)
    offset_m = points_m.astype(float) - origin_m
    along_m = offset_m @ forward
    aside_m = np.linalg.norm(offset_m - along_m[:, None] * forward, axis=1)
    angle = np.arctan2(aside_m, along_m)
    reached = angle <= np.radians(REACH_DEG)
    if not reached.any():
        return None
    front = reached & (along_m <= (1.0 + BEHIND) * along_m[reached].min())
    return int(np.argmin(np.where(front, angle, np.inf)))
