"""The brush that paints discs on a cloud, and the search for the point that was clicked."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import viser

from app.compute.records import Sample
from app.drawing.clouds import POINT_SIZE_M, add_cloud
from app.drawing.colors import HOLE
from app.screens.depth.view import Disc, SeenSample
from pipeline.types import BoolArray, FloatArray, IntArray

REACH_DEG = 1.0
"""Largest angle between a click's ray and the point that it selects."""
BEHIND = 0.05
"""Points up to this share farther than the nearest one in reach belong to the same surface."""
SIZE_M = 1.7 * POINT_SIZE_M


class BrushDrawing:
    """The painted points of one cloud, large and in the colour of unknown pixels."""

    def __init__(self, scene: viser.SceneApi, name: str) -> None:
        self._scene, self._name = scene, name

    def draw(self, cloud: SeenSample, T_world_camera: FloatArray, discs: Sequence[Disc]) -> None:
        """Replace the drawn points by those under these discs."""
        self._scene.remove_by_name(self._name)
        points_m = cloud.points_m[painted(cloud, discs)]
        if len(points_m):
            sample = Sample(points_m, None, len(points_m))
            add_cloud(self._scene, self._name, sample, T_world_camera, HOLE, SIZE_M)


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

    Of the points in reach, those of the nearest surface count, and of these the one closest to the ray:
    between the points of a sparse surface one sees the surface behind it.
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


AROUND = 2.5
"""Side of the image part that is shown for a disc, in diameters of the disc."""


def disc_px(disc: Disc, width_px: int, height_px: int) -> tuple[float, float, float]:
    """Return column and row of the centre, and the radius."""
    x, y = disc.x_share * (width_px - 1), disc.y_share * (height_px - 1)
    return x, y, 0.5 * disc.size_share * width_px


def disc_at(u: float, v: float, width_px: int, height_px: int, size_share: float) -> Disc:
    """Return the disc around a pixel."""
    return Disc(u / max(width_px - 1, 1), v / max(height_px - 1, 1), size_share)


def covered(
    discs: Sequence[Disc], u: IntArray | FloatArray, v: IntArray | FloatArray, width_px: int, height_px: int
) -> BoolArray:
    """Whether any disc covers the pixels of columns ``u`` and rows ``v``, which broadcast."""
    inside = np.zeros(np.broadcast_shapes(np.shape(u), np.shape(v)), dtype=bool)
    for disc in discs:
        x, y, radius = disc_px(disc, width_px, height_px)
        inside |= (u - x) ** 2 + (v - y) ** 2 <= radius**2
    return inside


def window_around(discs: Sequence[Disc], width_px: int, height_px: int) -> tuple[slice, slice]:
    """Return the rows and columns that show all discs (at least one) and their surroundings."""
    places = np.array([disc_px(disc, width_px, height_px) for disc in discs])
    half = AROUND * places[:, 2:]
    left, top = np.maximum(0.0, (places[:, :2] - half).min(axis=0)).astype(int)
    right, bottom = ((places[:, :2] + half).max(axis=0)).astype(int) + 1
    return slice(top, min(height_px, bottom)), slice(left, min(width_px, right))
