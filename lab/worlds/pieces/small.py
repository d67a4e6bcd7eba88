"""Random small objects on tables and shelves."""

from __future__ import annotations

import numpy as np

from lab.worlds.furniture import electronics, lights, plants, seating, storage, things
from lab.worlds.furniture.placing import place
from lab.worlds.pieces.solids import random_solid
from lab.worlds.pieces.stock import Makers, bounds, draw, moved
from lab.worlds.scene import Part, Rng
from pipeline.types import FloatArray


def small_thing(rng: Rng) -> list[Part]:
    """A random small object for a table or shelf."""
    makers: Makers[list[Part]] = [
        (2.0, lambda: things.cup(rng)),
        (2.0, lambda: things.bottle(rng)),
        (1.0, lambda: things.vase(rng, height_m=rng.uniform(0.15, 0.4))),
        (0.7, lambda: things.fruit_bowl(rng)),
        (2.0, lambda: things.book_pile(rng, count=int(rng.integers(1, 6)))),
        (1.5, lambda: things.papers(rng, count=int(rng.integers(1, 6)))),
        (0.7, lambda: things.pen_pot(rng)),
        (0.7, lambda: things.globe(rng, radius_m=rng.uniform(0.1, 0.2))),
        (0.7, lambda: things.teapot(rng)),
        (0.7, lambda: things.blocks(rng)),
        (0.7, lambda: lights.table_lamp(rng)),
        (0.5, lambda: plants.grass_plant(rng, height_m=rng.uniform(0.2, 0.45), leaves=14)),
        (0.8, lambda: electronics.laptop(rng, lit=bool(rng.integers(2)))),
        (0.6, lambda: electronics.speaker(rng, height_m=rng.uniform(0.15, 0.4))),
        (0.5, lambda: storage.paint_can(rng)),
        (0.8, lambda: storage.cardboard_box(rng, size_m=rng.uniform(0.1, 0.35, 3))),
        (0.8, lambda: seating.cushion(rng, size_m=rng.uniform(0.3, 0.5))),
        (5.0, lambda: random_solid(rng, 0.05, 0.3)),
    ]
    return draw(rng, makers)


def things_on(
    rng: Rng, low_m: tuple[float, float], high_m: tuple[float, float], z_m: float, count: int
) -> list[Part]:
    """Small objects at random places on a board, without overlaps.

    Args:
        rng: random generator.
        low_m: (x, y) lower corner of the places; objects reach at most 6 cm beyond the corners.
        high_m: (x, y) upper corner.
        z_m: height of the board.
        count: number of objects that are tried; one that does not fit is left out.
    """
    parts: list[Part] = []
    taken: list[tuple[FloatArray, FloatArray]] = []
    for _ in range(count):
        x, y = rng.uniform(low_m, high_m)
        piece = moved(small_thing(rng), place(x, y, rng.uniform(0.0, 2.0 * np.pi), z_m))
        low, high = bounds(piece)
        inside = np.all(low[:2] > np.asarray(low_m) - 0.06) and np.all(high[:2] < np.asarray(high_m) + 0.06)
        if inside and not any(np.all(low[:2] < b) and np.all(high[:2] > a) for a, b in taken):
            taken.append((low[:2], high[:2]))
            parts += piece
    return parts


def laden(rng: Rng, furniture: list[Part], share: float = 0.85) -> list[Part]:
    """Furniture with up to eight objects at the height of its highest point, on ``share`` of its size."""
    low, high = bounds(furniture)
    (x, y, _), (half_x, half_y, _) = 0.5 * (low + high), 0.5 * share * (high - low)
    top, count = float(high[2]) + 1e-3, int(rng.integers(0, 9))
    return furniture + things_on(rng, (x - half_x, y - half_y), (x + half_x, y + half_y), top, count)
