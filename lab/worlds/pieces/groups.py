"""Groups of furniture: desks with screens, tables with chairs, beds with pillows."""

from __future__ import annotations

import numpy as np

from lab.worlds.furniture import electronics, lights, seating, storage, tables
from lab.worlds.furniture.placing import ORIGIN, place, solid
from lab.worlds.pieces.small import laden, things_on
from lab.worlds.pieces.stock import bounds, moved
from lab.worlds.primitives import Mesh, box, rounded_box
from lab.worlds.primitives import moved as shifted
from lab.worlds.room_finishes import random_material
from lab.worlds.scene import Part, Rng
from pipeline.kernels.geometry import rigid, rotation_exp


def sofa(rng: Rng) -> list[Part]:
    """A sofa with up to two loose cushions."""
    seats = int(rng.integers(1, 4))
    parts = seating.sofa(rng, width_m=0.3 + 0.75 * seats * rng.uniform(0.9, 1.1), seats=seats)
    for _ in range(int(rng.integers(0, 3))):
        tilt = rotation_exp(np.array([rng.uniform(0.7, 1.3), 0.0, 0.0]))
        T = rigid(tilt, np.array([rng.uniform(-0.3, 0.3) * seats, 0.1, 0.62]))
        parts += moved(seating.cushion(rng, size_m=rng.uniform(0.35, 0.5)), T)
    return parts


def office(rng: Rng) -> list[Part]:
    """A desk with a screen, keyboard and clutter, often a chair, sometimes a partition behind."""
    width = rng.uniform(1.1, 2.0)
    parts = tables.desk(rng, width_m=width)
    top = float(bounds(parts)[1][2]) + 1e-3
    if rng.random() < 0.7:
        x = rng.uniform(-0.2, 0.2)
        T = place(x, 0.15, rng.normal(0.0, 0.2), top)
        parts += electronics.monitor(rng, T, rng.uniform(0.4, 0.7), bool(rng.integers(2)))
        parts += electronics.keyboard(rng, place(x, -0.15, rng.normal(0.0, 0.1), top))
        parts += electronics.mouse(rng, place(x + 0.32, -0.15, 0.0, top))
    if rng.random() < 0.5:
        parts += lights.desk_lamp(rng, place(-0.42 * width, 0.15, rng.uniform(-0.6, 0.6), top))
    for side in (-1.0, 1.0):
        left, right = sorted((side * 0.3, side * 0.46 * width))
        parts += things_on(rng, (left, -0.3), (right, 0.3), top, int(rng.integers(0, 5)))
    if rng.random() < 0.3:
        screen = _standing(width, 0.04, rng.uniform(1.1, 1.5))
        parts.append(solid(screen, random_material(rng), ORIGIN, (0.0, 0.42, 0.0)))
    if rng.random() < 0.6:
        T = place(rng.uniform(-0.3, 0.3), -rng.uniform(0.55, 0.8), np.pi + rng.normal(0.0, 0.7))
        parts += seating.office_chair(rng, T)
    return parts


def dining(rng: Rng) -> list[Part]:
    """A table with chairs around it and objects on it."""
    size = rng.uniform((0.8, 0.7, 0.7), (1.8, 1.0, 0.78))
    parts = laden(rng, tables.table(rng, size_m=size))
    color = f"#{int(rng.integers(0x202020, 0xE0E0E0)):06x}" if rng.random() < 0.3 else None
    for side in (0.0, np.pi):
        for x in np.arange(-0.5 * size[0] + 0.35, 0.5 * size[0] - 0.2, 0.62):
            if rng.random() < 0.75:
                T = place(x, 0.5 * size[1] + rng.uniform(-0.1, 0.25), rng.normal(0.0, 0.2))
                parts += moved(seating.dining_chair(rng, T, color), place(0.0, 0.0, side))
    return parts


def bed(rng: Rng) -> list[Part]:
    """A bed with a mattress, blanket and pillows, its head (+y) at the wall."""
    width, length = rng.uniform(0.9, 1.8), rng.uniform(1.9, 2.1)
    parts = storage.cabinet(rng, size_m=(width, length, 0.28), doors=2)
    mattress = rounded_box((width - 0.04, length - 0.04, 0.22), 0.06)
    parts.append(solid(mattress, random_material(rng), ORIGIN, (0, 0, 0.39)))
    blanket = rounded_box((width + 0.04, 0.65 * length, 0.14), 0.06, 0.03)
    parts.append(solid(blanket, random_material(rng), ORIGIN, (0, -0.17 * length, 0.47)))
    for x in np.arange(-0.5 * width + 0.4, 0.5 * width, 0.75):
        parts += seating.cushion(rng, place(x, 0.36 * length, rng.normal(0, 0.1), 0.5), size_m=0.5)
    head = _standing(width, 0.05, rng.uniform(0.6, 1.1))
    return [*parts, solid(head, random_material(rng), ORIGIN, (0.0, 0.5 * length + 0.03, 0.0))]


def television(rng: Rng) -> list[Part]:
    """A television on a low cabinet."""
    cabinet = storage.cabinet(rng, size_m=rng.uniform((1.1, 0.35, 0.35), (1.8, 0.5, 0.6)))
    on_top = place(0.0, 0.0, 0.0, float(bounds(cabinet)[1][2]))
    return cabinet + electronics.television(rng, on_top, rng.uniform(0.7, 1.3), bool(rng.integers(2)))


def filled_crate(rng: Rng) -> list[Part]:
    """A crate with up to four small objects in it."""
    size = rng.uniform((0.35, 0.3, 0.2), (0.6, 0.45, 0.35))
    half = (0.35 * size[0], 0.35 * size[1])
    return storage.crate(rng, size_m=size) + things_on(rng, (-half[0], -half[1]), half, 0.02, 4)


def _standing(x_m: float, y_m: float, z_m: float) -> Mesh:
    """Return a box that stands on z = 0."""
    return shifted(box((x_m, y_m, z_m)), z_m=0.5 * z_m)
