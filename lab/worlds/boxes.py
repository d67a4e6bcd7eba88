"""The plain test room of SPEC 4.8: boxes and balls, seen by cameras whose true poses are known."""

from __future__ import annotations

import numpy as np

from lab.worlds.furniture.placing import ORIGIN, board, place, solid
from lab.worlds.primitives import sphere
from lab.worlds.room_finishes import draw_seed, muted, random_floor, random_wall
from lab.worlds.scene import Light, Material, Part, Rng, Scene
from lab.worlds.textures import plaster, random_palette
from packetmesh.errors import InputError
from pipeline.kernels.geometry import look_at
from pipeline.types import CameraIntrinsics, FloatArray


def box_room(seed: int, nodes: int = 2, angle_deg: float = 25.0, baseline_m: float = 1.0) -> Scene:
    """A room with 4 to 7 boxes and 1 to 3 balls; with the defaults, the views overlap by about 60 %.

    Args:
        seed: chooses everything but the cameras' spacing.
        nodes: number of cameras, 1 to 6.
        angle_deg: angle between the headings of neighbouring cameras, 5 to 60.
        baseline_m: distance between neighbouring cameras, 0.1 to 3.

    Raises:
        InputError: an argument is out of its range.
    """
    _check(nodes, angle_deg, baseline_m)
    rng = np.random.default_rng([seed, 4808])
    reach_m = baseline_m / (2.0 * np.sin(np.radians(angle_deg) / 2.0))
    cameras = _cameras(rng, nodes, np.radians(angle_deg), reach_m)
    eyes = np.array([camera[:3, 3] for camera in cameras])
    low = np.minimum([-2.4, -2.4, 0.0], eyes.min(axis=0) - 0.5) * [1, 1, 0]
    high = np.maximum([2.4, 1.7, 2.6], eyes.max(axis=0) + 0.5)
    parts = [*_shell(rng, low, high), *_things(rng, eyes)]
    lamp = Light(np.array([*rng.uniform(-0.8, 0.8, 2), high[2] - 0.25]), np.array([3.2, 3.0, 2.7]), 0.2)
    window = Light(np.array([low[0] + 0.3, rng.uniform(-1.0, 0.5), 1.6]), np.array([1.0, 1.15, 1.35]), 0.4)
    intrinsics = CameraIntrinsics.pinhole(262.5, 262.5, 159.5, 119.5, 320, 240)
    return Scene(f"boxes-{seed}", tuple(parts), (lamp, window), np.full(3, 0.3), cameras, intrinsics)


def _check(nodes: int, angle_deg: float, baseline_m: float) -> None:
    for name, value, low, high in (
        ("nodes", nodes, 1, 6),
        ("angle_deg", angle_deg, 5.0, 60.0),
        ("baseline_m", baseline_m, 0.1, 3.0),
    ):
        if not low <= value <= high:
            raise InputError(f"A box room's {name} is {value:g}; take {low:g} to {high:g}.")


def _cameras(rng: Rng, nodes: int, angle_rad: float, reach_m: float) -> tuple[FloatArray, ...]:
    """Return T_world_camera on an arc of radius ``reach_m`` about the room's middle, ``angle_rad`` apart."""
    tilt = rng.uniform(0.12, 0.3)
    target = np.array([0.0, 0.0, rng.uniform(0.6, 0.9)])
    heading = -np.pi / 2.0 + (np.arange(nodes) - (nodes - 1) / 2.0) * angle_rad
    places = [target + reach_m * np.array([np.cos(h), np.sin(h), 0.0]) for h in heading]
    lift = np.array([0.0, 0.0, min(1.0, reach_m * np.tan(tilt))])
    # All cameras look at one point, below the arc's centre, so they look down equally.
    return tuple(look_at(place + lift, target) for place in places)


def _shell(rng: Rng, low: FloatArray, high: FloatArray) -> list[Part]:
    """Floor, ceiling and walls as slabs; parts[0] is the floor."""
    size, middle = high - low, 0.5 * (low + high)
    wall, ceiling = random_wall(rng), Material(plaster(muted(rng, 1, 0.6, 0.8)[0]))
    parts = []
    for axis, sides in ((2, (-1.0, 1.0)), (0, (-1.0, 1.0)), (1, (-1.0, 1.0))):
        for side in sides:
            material = wall if axis != 2 else (random_floor(rng) if side < 0 else ceiling)
            slab, at = size + 0.2, middle.copy()
            slab[axis], at[axis] = 0.1, middle[axis] + side * (0.5 * size[axis] + 0.05)
            parts.append(board(slab, material, ORIGIN, at))
    return parts


def _things(rng: Rng, eyes: FloatArray) -> list[Part]:
    """Boxes and balls on the floor about the middle, their centres 1.1 m or more from every camera."""
    boxes, balls = int(rng.integers(4, 8)), int(rng.integers(1, 4))
    parts = []
    for k, spot in enumerate(_spots(rng, eyes[:, :2], boxes + balls)):
        if k < boxes:
            size = rng.uniform([0.25, 0.25, 0.25], [0.7, 0.7, 1.2])
            standing = place(spot[0], spot[1], rng.uniform(0.0, np.pi), 0.5 * size[2])
            parts.append(board(size, _paint(rng), standing))
        else:
            radius = rng.uniform(0.15, 0.35)
            parts.append(solid(sphere(radius), _paint(rng), ORIGIN, (*spot, radius)))
    return parts


def _spots(rng: Rng, eyes_m: FloatArray, count: int) -> list[FloatArray]:
    """Return (2,) places on the floor: of 12 random ones each time the farthest from those before."""
    spots: list[FloatArray] = []
    while len(spots) < count:
        tries = rng.uniform([-1.7, -1.2], [1.7, 1.4], (12, 2))
        tries = tries[np.min(np.linalg.norm(tries[:, None] - eyes_m, axis=2), axis=1) > 1.1]
        if not len(tries):
            continue
        others = np.array(spots) if spots else np.full((1, 2), 9.0)
        spots.append(tries[np.argmax(np.min(np.linalg.norm(tries[:, None] - others, axis=2), axis=1))])
    return spots


def _paint(rng: Rng) -> Material:
    color = 0.08 + 0.8 * random_palette(rng, 1)[0]
    return Material(plaster(color, draw_seed(rng), 0.03, 0.15))
