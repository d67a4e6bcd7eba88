"""A living room in the late afternoon: a seating group in a corner, a television off, a lamp on."""

from __future__ import annotations

import numpy as np

from lab.worlds import textures
from lab.worlds.furniture import electronics, fixtures, lights, plants, seating, storage, tables, things
from lab.worlds.furniture.finishes import painted
from lab.worlds.furniture.placing import place
from lab.worlds.scene import Light, Material, Part, Rng, Scene
from lab.worlds.staging import EAST, NORTH, SOUTH, VGA, WALL_M, WEST, arc, shell, sun

SIZE_M = (4.7, 4.3, 2.6)
WINDOW = (0.15, 0.85, 1.8, 1.45)


def living_room() -> Scene:
    """Return the scene; all random choices are seeded."""
    rng = np.random.default_rng(11)
    return Scene(
        "living-room",
        (*_room(rng), *_seats(rng), *_media(rng), *_table(rng)),
        (
            sun((0.0, 2.3, 1.6), (2.6, 2.75, 0.42), 9.0),
            Light(np.array([0.4, 2.3, 1.6]), np.array([3.0, 3.15, 3.3]), 0.5),
            Light(np.array([4.35, 3.95, 1.42]), np.array([1.0, 0.72, 0.45]), 0.12),
        ),
        np.array([0.26, 0.27, 0.29]),
        arc((3.45, 3.0, 0.85), 2.35, 1.5, (202.0, 226.0, 250.0)),
        VGA,
    )


def _room(rng: Rng) -> list[Part]:
    wall = Material(textures.plaster("#dfd8ca", 3, 0.01, 0.05))
    accent = Material(textures.plaster("#7f8f88", 4, 0.01, 0.05))
    floor = Material(textures.planks("#b58a5c", "#85603a", 5, 0.13, 1.6), 0.12)
    return [
        *shell(rng, SIZE_M, floor, (wall, wall, wall, accent), painted(rng, "#f4f2ec", 0.0), {WEST: WINDOW}),
        *fixtures.window(rng, place(0.0, 2.3, WEST, 0.85), (1.8, 1.45), recess_m=WALL_M - 0.04),
        *fixtures.curtains(rng, place(0.0, 2.3, WEST), 2.7, 2.35, "#c8bda6"),
        *fixtures.radiator(rng, place(0.0, 2.3, WEST), 1.4),
        *fixtures.door(rng, place(1.2, 0.0, SOUTH)),
        *fixtures.rug(rng, place(3.05, 2.75), (2.3, 1.6), ("#a8563f", "#d9cbb0", "#31424f", "#c08a4a")),
        *fixtures.picture(rng, place(2.75, SIZE_M[1], NORTH, 1.5), (0.8, 0.6), "#5b3a24"),
        *fixtures.picture(rng, place(3.6, SIZE_M[1], NORTH, 1.6), (0.4, 0.5), "#22201e"),
        *fixtures.picture(rng, place(3.6, SIZE_M[1], NORTH, 1.1), (0.4, 0.3), "#22201e"),
    ]


def _seats(rng: Rng) -> list[Part]:
    lean = np.array([[1.0, 0.0, 0.0], [0.0, np.sin(0.4), -np.cos(0.4)], [0.0, np.cos(0.4), np.sin(0.4)]])

    def leaning(x_m: float, y_m: float, yaw_rad: float) -> np.ndarray:
        T = place(x_m, y_m, yaw_rad, 0.7)
        T[:3, :3] = T[:3, :3] @ lean
        return T

    sofa_y = SIZE_M[1] - 0.52
    return [
        *seating.sofa(rng, place(2.95, sofa_y), 2.05, "#b9ab93"),
        *seating.cushion(rng, leaning(2.28, sofa_y + 0.06, 0.25), "#b8643a"),
        *seating.cushion(rng, leaning(3.6, sofa_y + 0.06, -0.2), "#3d5a63", 0.4),
        *seating.armchair(rng, place(1.45, 2.95, 1.15), "#55697a"),
        *lights.floor_lamp(rng, place(4.3, 3.92)),
    ]


def _media(rng: Rng) -> list[Part]:
    x = SIZE_M[0] - 0.24
    return [
        *storage.cabinet(rng, place(x, 2.35, EAST), (1.6, 0.42, 0.52), "#8a5a33", 4),
        *electronics.television(rng, place(x, 2.35, EAST, 0.52), 1.15),
        *electronics.speaker(rng, place(x, 1.68, EAST, 0.52), 0.28),
        *plants.grass_plant(rng, place(x, 3.05, 0.0, 0.52), 0.34),
        *plants.potted_plant(rng, place(4.25, 3.3), 1.15, "#a65a3a"),
        *fixtures.wall_shelf(rng, place(SIZE_M[0], 1.95, EAST, 1.62), 1.1, "#8a5a33"),
        *storage.books(rng, place(SIZE_M[0] - 0.12, 2.4, EAST, 1.62), 0.45, 0.26, 0.24),
        *things.vase(rng, place(SIZE_M[0] - 0.11, 1.75, 0.0, 1.62), 0.24, "#2f5d73"),
        *things.globe(rng, place(SIZE_M[0] - 0.12, 1.52, 0.5, 1.62), 0.08),
        *fixtures.picture(rng, place(SIZE_M[0], 3.35, EAST, 1.55), (0.5, 0.7), "#e9e6df"),
    ]


def _table(rng: Rng) -> list[Part]:
    top = 0.42
    x, y = 2.95, 2.75
    return [
        *tables.coffee_table(rng, place(x, y), "#a8754a"),
        *things.fruit_bowl(rng, place(x + 0.05, y + 0.06, 0.0, top), "#e9e4d8"),
        *things.book_pile(rng, place(x - 0.32, y - 0.05, 0.4, top), 3),
        *things.cup(rng, place(x + 0.32, y - 0.12, 0.7, top), "#c7653f"),
        *things.bottle(rng, place(x + 0.4, y + 0.14, 0.0, top)),
        *things.book_pile(rng, place(x + 0.2, y, 0.1, 0.15), 4),
        *things.blocks(rng, place(x + 0.8, y - 0.42, 0.6, 0.013), 6),
    ]
