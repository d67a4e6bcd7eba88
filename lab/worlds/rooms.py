"""Random furnished rooms: training data for the depth network, and held-out rooms that judge it."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from lab.worlds import pieces
from lab.worlds.furniture import placing
from lab.worlds.primitives import box
from lab.worlds.render import Renderer
from lab.worlds.room_finishes import covered, lamp_white, muted, random_material, recolored
from lab.worlds.scene import Light, Material, Part, Rng, Scene
from lab.worlds.shell import shell, wall_length, wall_pose
from lab.worlds.textures import paint
from lab.worlds.viewpoints import random_views
from pipeline.types import CameraIntrinsics, FloatArray


@dataclass(slots=True)
class _Plan:
    """A room that is being furnished."""

    seed: int
    size_m: FloatArray
    """(3,) inner width (x), depth (y) and height."""
    parts: list[Part]
    taken: list[tuple[FloatArray, FloatArray]] = field(default_factory=list)
    """Low and high (x, y) corners of the pieces on the floor."""

    def add_free(self, piece: list[Part], T: FloatArray, gap_m: float = 0.04) -> bool:
        """Put a piece at ``T`` if it is inside the room and overlaps no other; return whether it was put."""
        moved = pieces.moved(piece, T)
        low, high = pieces.bounds(moved)
        half = 0.5 * self.size_m[:2] - 0.01
        if np.any(low[:2] < -half) or np.any(high[:2] > half) or high[2] > self.size_m[2]:
            return False
        if any(np.all(low[:2] < b + gap_m) and np.all(high[:2] > a - gap_m) for a, b in self.taken):
            return False
        self.taken.append((low[:2], high[:2]))
        self.parts += moved
        return True


def random_room(seed: int) -> Scene:
    """A closed, furnished, lit room with a camera in it; parts[0] is the floor slab, parts[:6] the shell."""
    rng = np.random.default_rng([seed, 7301])
    size_m = np.array([rng.uniform(2.5, 6.0), rng.uniform(2.5, 6.0), rng.uniform(2.3, 3.0)])
    if rng.random() < 0.12:
        size_m[:2] *= 1.5
    plan = _Plan(seed, size_m, shell(rng, size_m, 0.55))
    windows = _dress_walls(plan, rng)
    _furnish_walls(plan, rng)
    _furnish_middle(plan, rng)
    lights, ambient = _lights(rng, size_m, windows)
    scene = Scene(f"room-{seed}", tuple(plan.parts), lights, ambient, (), _intrinsics(rng))
    return replace(scene, cameras=tuple(random_views(scene, rng, 1, Renderer(scene))))


def _dress_walls(plan: _Plan, rng: Rng) -> list[FloatArray]:
    """Add skirting, windows, doors, pictures and shelves; return (3,) places of light at windows."""
    windows = []
    skirting = Material(paint(muted(rng, 1, 0.1, 0.8)[0], 2)) if rng.random() < 0.6 else None
    for wall in range(4):
        length = wall_length(plan.size_m, wall)
        if skirting is not None:
            mesh = box((length, 0.018, rng.uniform(0.05, 0.12)))
            plan.parts.append(Part(*mesh, skirting, wall_pose(plan.size_m, wall, 0.0, 0.009, 0.03)))
        start = -0.5 * length + rng.uniform(0.1, 0.5)
        while True:
            piece = pieces.from_stock(pieces.random_wall_piece, plan.seed, rng)
            start += 0.5 * piece.width_m
            if start + 0.5 * piece.width_m > 0.5 * length - 0.05:
                break
            T = wall_pose(plan.size_m, wall, start, 0.0, piece.height_m)
            plan.parts += pieces.moved(piece.parts, T)
            if piece.daylight:
                windows.append((T @ np.array([0.0, -0.35, 0.6, 1.0]))[:3])
            start += 0.5 * piece.width_m + rng.uniform(0.05, 1.2)
    return windows


def _furnish_walls(plan: _Plan, rng: Rng) -> None:
    """Add sofas, shelves, cabinets, desks and clutter with their backs to the walls."""
    for _ in range(int(rng.integers(4, 10))):
        piece = _varied(pieces.from_stock(pieces.random_wall_furniture, plan.seed, rng), rng)
        low, high = pieces.bounds(piece)
        for _ in range(10):
            wall = int(rng.integers(4))
            reach = 0.5 * wall_length(plan.size_m, wall) - 0.5 * (high[0] - low[0])
            if reach <= 0.0:
                continue
            inset = high[1] + rng.choice([0.03, rng.uniform(0.03, 0.25)])
            if plan.add_free(piece, wall_pose(plan.size_m, wall, rng.uniform(-reach, reach), inset)):
                break


def _furnish_middle(plan: _Plan, rng: Rng) -> None:
    """Add tables with chairs, rugs, boxes and single objects."""
    if rng.random() < 0.35:
        rug = pieces.random_rug(rng)
        x, y = rng.uniform(-0.2, 0.2, 2) * plan.size_m[:2]
        T = placing.place(x, y, rng.uniform(0.0, 2.0 * np.pi))
        plan.parts += pieces.moved(rug, T)
    half = 0.5 * plan.size_m[:2]
    for k in range(int(rng.integers(4, 13))):
        maker = pieces.random_group if k < 2 else pieces.random_floor_thing
        piece = _varied(pieces.from_stock(maker, plan.seed, rng), rng)
        for _ in range(8):
            x, y = rng.uniform(-half, half)
            if plan.add_free(piece, placing.place(x, y, rng.uniform(0.0, 2.0 * np.pi))):
                break


def _varied(piece: list[Part], rng: Rng) -> list[Part]:
    """Return a piece unchanged, in other colours, or all of a random material."""
    kind = rng.random()
    if kind < 0.3:
        return piece
    if kind < 0.88:
        return recolored(piece, rng)
    return covered(piece, random_material(rng))


def _lights(rng: Rng, size_m: FloatArray, windows: list[FloatArray]) -> tuple[tuple[Light, ...], FloatArray]:
    """Return one to four area lights and the (3,) ambient light, from a warm evening to a grey day."""
    lights = []
    for place in windows[:2]:
        if rng.random() < 0.75:
            sky = np.array([0.85, 0.95, 1.1]) * rng.uniform(0.8, 1.2, 3)
            lights.append(Light(place, sky * rng.uniform(1.0, 4.0), rng.uniform(0.3, 0.6)))
    for _ in range(int(rng.integers(0 if lights else 1, 3))):
        x, y = rng.uniform(-0.4, 0.4, 2) * size_m[:2]
        z = size_m[2] - rng.uniform(0.15, 0.5) if rng.random() < 0.8 else rng.uniform(1.3, 1.8)
        color = lamp_white(rng) * rng.uniform(0.8, 3.5)
        lights.append(Light(np.array([x, y, z]), color, rng.uniform(0.05, 0.4)))
    ambient = 0.5 * (lamp_white(rng) + 1.0) * rng.uniform(0.05, 0.4)
    return tuple(lights), ambient


def _intrinsics(rng: Rng) -> CameraIntrinsics:
    """Return random intrinsics of a Kinect v1's colour camera: 525 px +- 5 % at 640 x 480."""
    focal_px = 525.0 * rng.uniform(0.95, 1.05)
    cx_px, cy_px = 319.5 + rng.normal(0.0, 4.0), 239.5 + rng.normal(0.0, 4.0)
    return CameraIntrinsics.pinhole(focal_px, focal_px, cx_px, cy_px, 640, 480)
