"""A box of known size on a table in a corner, with a few objects around it."""

from __future__ import annotations

import numpy as np

from lab.worlds import textures
from lab.worlds.furniture import electronics, fixtures, lights, plants, seating, tables, things
from lab.worlds.furniture.finishes import cardboard, painted
from lab.worlds.furniture.placing import board, place
from lab.worlds.scene import Light, Material, Part, Rng, Scene
from lab.worlds.staging import NORTH, SOUTH, VGA, WALL_M, WEST, arc, shell, sun

SIZE_M = (3.4, 3.2, 2.5)
WINDOW = (0.3, 0.9, 1.2, 1.3)
TABLE_M = (2.5, 2.55, 0.74)
BOX_M = (0.30, 0.20, 0.15)
"""Length, width and height of the box (SPEC 7)."""
BOX_YAW_RAD = 0.35


def box_on_table() -> Scene:
    """Return the scene; the box is its first part."""
    rng = np.random.default_rng(41)
    x, y, top = TABLE_M
    box = board(
        BOX_M, cardboard(rng, 0.3), place(x - 0.02, y - 0.02, BOX_YAW_RAD, top), (0.0, 0.0, BOX_M[2] / 2)
    )
    return Scene(
        "box-on-table",
        (box, *_room(rng), *_table(rng), *_around(rng)),
        (
            sun((0.0, 1.75, 1.6), (2.2, 2.45, 0.78), 5.0),
            Light(np.array([0.35, 1.9, 1.6]), np.array([3.2, 3.3, 3.4]), 0.45),
            Light(np.array([x + 0.55, y + 0.28, top + 0.36]), np.array([0.55, 0.42, 0.28]), 0.06),
            Light(np.array([1.6, 1.2, 2.3]), np.array([1.6, 1.45, 1.25]), 0.15),
        ),
        np.array([0.24, 0.24, 0.25]),
        arc((x, y, top + 0.1), 1.35, 1.42, (206.0, 231.0, 256.0)),
        VGA,
    )


def _room(rng: Rng) -> list[Part]:
    wall = Material(textures.plaster("#e2dccf", 16, 0.01, 0.04))
    paper = Material(textures.motif("#b7c0b0", "#8fa08f", 17, 0.13))
    floor = Material(textures.parquet("#b8864f", "#8a5e34", 18), 0.05)
    return [
        *shell(rng, SIZE_M, floor, (wall, wall, wall, paper), painted(rng, "#f4f2ec", 0.0), {WEST: WINDOW}),
        *fixtures.window(rng, place(0.0, 1.9, WEST, 0.9), (1.2, 1.3), recess_m=WALL_M - 0.04),
        *fixtures.door(rng, place(1.2, 0.0, SOUTH)),
        *fixtures.picture(rng, place(2.3, SIZE_M[1], NORTH, 1.5), (0.55, 0.42), "#8a5a33"),
    ]


def _table(rng: Rng) -> list[Part]:
    x, y, height = TABLE_M
    return [
        *tables.table(rng, place(x, y), (1.5, 0.9, height), "#a8754a"),
        *seating.dining_chair(rng, place(x - 0.95, y + 0.1, -np.pi / 2 - 0.3), "#8a5a33"),
        *seating.dining_chair(rng, place(x + 0.35, y - 0.72, np.pi + 0.25), "#8a5a33"),
    ]


def _around(rng: Rng) -> list[Part]:
    x, y, top = TABLE_M
    return [
        *lights.table_lamp(rng, place(x + 0.55, y + 0.28, 0.0, top), "#2f5d73"),
        *things.bottle(rng, place(x + 0.3, y + 0.2, 0.0, top)),
        *things.fruit_bowl(rng, place(x - 0.42, y + 0.2, 0.0, top), "#dfe5e3", 6),
        *things.cup(rng, place(x + 0.28, y - 0.16, 0.6, top), "#f2efe8"),
        *things.book_pile(rng, place(x - 0.45, y - 0.18, 0.5, top), 3),
        *plants.grass_plant(rng, place(x + 0.05, y + 0.32, 0.0, top), 0.3, "#e6e1d6"),
        *electronics.tablet(rng, place(x + 0.02, y - 0.28, -0.5, top)),
        *things.teapot(rng, place(x + 0.45, y - 0.02, 2.4, top), "#9fb3b0"),
    ]
