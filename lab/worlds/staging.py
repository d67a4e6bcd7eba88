"""Common parts of the demo scenes: a closed room, sunlight, and nodes on an arc that look at one place."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from lab.worlds.furniture.finishes import painted
from lab.worlds.furniture.placing import ORIGIN, board, place, solid
from lab.worlds.primitives import Mesh, box, merged, moved
from lab.worlds.scene import Light, Material, Part, Rng
from pipeline.kernels.geometry import look_at
from pipeline.types import CameraIntrinsics, FloatArray

VGA = CameraIntrinsics.pinhole(525.0, 525.0, 319.5, 239.5, 640, 480)
"""The colour camera of a first-generation Kinect."""
WEST, EAST, SOUTH, NORTH = np.pi / 2.0, -np.pi / 2.0, np.pi, 0.0
"""Yaw of pieces with their back to the wall at x = 0, x = max, y = 0 and y = max."""
WALL_M = 0.22
"""Thickness of floor, ceiling and walls."""

Opening = tuple[float, float, float, float]
"""A window's hole, metres: distance of its centre from the wall's middle, to the right seen from the room;
height of its lower edge above the floor; width; height."""


def shell(
    rng: Rng,
    size_m: Sequence[float],
    floor: Material,
    walls: Sequence[Material],
    ceiling: Material,
    openings: Mapping[float, Opening],
    skirting: str = "#efece4",
) -> list[Part]:
    """Return floor, ceiling, walls and skirting boards around the room (0, 0, 0) to ``size_m``.

    Args:
        rng: random generator of the paint.
        size_m: (x, y, z) inner size.
        floor: material of the floor.
        walls: materials of the west, east, south and north wall.
        ceiling: material of the ceiling.
        openings: the windows' holes by wall, ``WEST`` to ``NORTH``.
        skirting: colour of the skirting boards.
    """
    x, y, z = size_m
    paint = painted(rng, skirting, 0.15)
    slab = (x + 2.0 * WALL_M, y + 2.0 * WALL_M, WALL_M)
    parts = [
        board(slab, floor, ORIGIN, (x / 2, y / 2, -WALL_M / 2)),
        board(slab, ceiling, ORIGIN, (x / 2, y / 2, z + WALL_M / 2)),
    ]
    sides = ((WEST, 0.0, y / 2, y), (EAST, x, y / 2, y), (SOUTH, x / 2, 0.0, x), (NORTH, x / 2, y, x))
    for (yaw, at_x, at_y, length), material in zip(sides, walls, strict=True):
        foot = place(at_x, at_y, yaw)
        parts.append(solid(_wall(length, z, openings.get(yaw)), material, foot, smooth=False))
        parts.append(board((length - 0.024, 0.012, 0.09), paint, foot, (0.0, -0.006, 0.045), edge_m=0.003))
    return parts


def _wall(length_m: float, height_m: float, opening: Opening | None) -> Mesh:
    """Return a wall behind y = 0, centred on x = 0 and longer by ``WALL_M`` at both ends, for the corners."""
    total = length_m + 2.0 * WALL_M
    if opening is None:
        return moved(box((total, WALL_M, height_m)), 0.0, WALL_M / 2, height_m / 2)
    center, low, width, high = opening
    left, right, above = (total - width) / 2 + center, (total - width) / 2 - center, height_m - low - high
    blocks = [
        (left, height_m, (left - total) / 2, height_m / 2),
        (right, height_m, (total - right) / 2, height_m / 2),
        (width, low, center, low / 2),
        (width, above, center, height_m - above / 2),
    ]
    return merged([moved(box((w, WALL_M, h)), x, WALL_M / 2, z) for w, h, x, z in blocks])


def sun(through_m: Sequence[float], onto_m: Sequence[float], irradiance: float) -> Light:
    """Return sunlight through one place (in a window) onto another.

    ``irradiance`` is that of red light there, on a surface that faces the sun.
    """
    through, onto = np.asarray(through_m, float), np.asarray(onto_m, float)
    way = (through - onto) / np.linalg.norm(through - onto)
    distance_m = 15.0
    color = irradiance * distance_m**2 * np.array([1.0, 0.89, 0.74])
    return Light(onto + distance_m * way, color, 0.12)


def arc(
    target_m: Sequence[float], distance_m: float, height_m: float, azimuths_deg: Sequence[float]
) -> tuple[FloatArray, ...]:
    """Return T_world_camera of nodes that look at ``target_m`` from this horizontal distance and height.

    Azimuths are those of the nodes seen from the target, from +x towards +y.
    """
    poses = []
    for azimuth in np.radians(azimuths_deg):
        x = target_m[0] + distance_m * np.cos(azimuth)
        y = target_m[1] + distance_m * np.sin(azimuth)
        poses.append(look_at((x, y, height_m), target_m))
    return tuple(poses)
