"""The shell of a rectangular room, the origin in the middle of its floor, and poses against its walls."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from lab.worlds.furniture.placing import ORIGIN, board, place
from lab.worlds.room_finishes import muted, random_floor, random_wall
from lab.worlds.scene import Material, Part, Rng
from lab.worlds.textures import paint
from pipeline.types import FloatArray

Finish = Callable[[Rng], Material]


def shell(
    rng: Rng,
    size_m: FloatArray,
    darkest_ceiling: float,
    wall: Finish = random_wall,
    floor: Finish = random_floor,
) -> list[Part]:
    """Return slabs around the inner size: floor, ceiling, four walls. One wall in five has another finish.

    ``darkest_ceiling`` is the least luminance of a painted ceiling, 0 to 0.85.
    """
    x, y, z = size_m
    white = muted(rng, 1, darkest_ceiling, 0.85)[0]
    ceiling = Material(paint(white, 1, 0.04)) if rng.random() < 0.85 else random_wall(rng)
    walls = wall(rng)
    parts = [
        board((x, y, 0.1), floor(rng), ORIGIN, (0.0, 0.0, -0.05)),
        board((x, y, 0.1), ceiling, ORIGIN, (0.0, 0.0, z + 0.05)),
    ]
    for axis in (0, 1):
        for side in (-1.0, 1.0):
            material = random_wall(rng) if rng.random() < 0.2 else walls
            slab, at = np.array([x, y, z]), np.array([0.0, 0.0, 0.5 * z])
            slab[axis], at[axis] = 0.1, side * (0.5 * size_m[axis] + 0.05)
            slab[1 - axis] += 0.2
            parts.append(board(slab, material, ORIGIN, at))
    return parts


def wall_pose(
    size_m: FloatArray, wall: int, along_m: float, inset_m: float = 0.0, z_m: float = 0.0
) -> FloatArray:
    """Return a pose against one of four walls, front (-y) to the room, ``along_m`` from the wall's middle.

    Walls 0 to 3 are those at +y, -x, -y and +x; ``inset_m`` is the distance from the wall.
    """
    reach_m = 0.5 * (size_m[1] if wall % 2 == 0 else size_m[0]) - inset_m
    return place(0.0, 0.0, wall * np.pi / 2.0) @ place(along_m, reach_m, 0.0, z_m)


def wall_length(size_m: FloatArray, wall: int) -> float:
    """Return the length of one of the four walls, metres."""
    return float(size_m[0] if wall % 2 == 0 else size_m[1])
