"""A workshop: a bench with a vice under a board of tools, a brick wall, timber, tins and shavings."""

from __future__ import annotations

import numpy as np

from lab.worlds import textures
from lab.worlds.furniture import fixtures, lights, seating, stock, storage, tables, things, tools
from lab.worlds.furniture.finishes import wood
from lab.worlds.furniture.placing import board, place
from lab.worlds.scene import Light, Material, Part, Rng, Scene
from lab.worlds.staging import EAST, NORTH, SOUTH, VGA, WALL_M, WEST, arc, shell, sun

SIZE_M = (4.6, 4.0, 2.8)
WINDOW = (-0.4, 1.15, 1.5, 1.1)
BENCH_M = (2.55, SIZE_M[1] - 0.36)


def workshop() -> Scene:
    """Return the scene; all random choices are seeded."""
    rng = np.random.default_rng(37)
    return Scene(
        "workshop",
        (*_room(rng), *_bench(rng), *_rack(rng), *_floor(rng)),
        (
            sun((0.0, 1.75, 1.9), (2.7, 3.3, 0.75), 7.0),
            Light(np.array([0.4, 1.6, 1.8]), np.array([2.3, 2.4, 2.5]), 0.5),
            Light(np.array([2.45, 3.1, 1.62]), np.array([1.5, 1.2, 0.85]), 0.06),
        ),
        np.array([0.17, 0.17, 0.17]),
        arc((2.85, 3.0, 0.9), 2.3, 1.55, (208.0, 233.0, 258.0)),
        VGA,
    )


def _room(rng: Rng) -> list[Part]:
    brick = Material(textures.brick("#8f4a34", "#a39a8c", 12))
    white = Material(textures.brick("#ddd6c4", "#bdb5a2", 13))
    floor = Material(textures.concrete("#8c8983", 14), 0.03)
    ceiling = Material(textures.planks("#b99a70", "#927549", 15, 0.14, 2.0))
    return [
        *shell(rng, SIZE_M, floor, (white, white, white, brick), ceiling, {WEST: WINDOW}, "#6f6c66"),
        *fixtures.window(rng, place(0.0, 1.6, WEST, 1.15), (1.5, 1.1), panes=3, recess_m=WALL_M - 0.04),
        *fixtures.door(rng, place(3.4, 0.0, SOUTH), "#2f5d73"),
        *lights.pendant_lamp(rng, place(2.45, 3.1, 0.0, SIZE_M[2]), "#2f4f46"),
    ]


def _bench(rng: Rng) -> list[Part]:
    x, y = BENCH_M
    top = 0.86
    return [
        *tables.workbench(rng, place(x, y), 1.9, "#ab8760"),
        *tools.tool_board(rng, place(x - 0.02, SIZE_M[1], NORTH, 1.12)),
        *tools.toolbox(rng, place(x + 0.62, y + 0.12, 0.12, top), "#a8231f"),
        *tools.drill(rng, place(x + 0.1, y + 0.02, 2.6, top)),
        *tools.plane(rng, place(x - 0.22, y - 0.12, 0.5, top)),
        *things.bottle(rng, place(x - 0.05, y + 0.22, 0.0, top), "#3b2413", label=False),
        *storage.paint_can(rng, place(x - 0.45, y + 0.2, 0.7, top), "#e3c15a"),
        *storage.paint_can(rng, place(x - 0.57, y + 0.14, 2.0, top), "#2f5d73"),
        *things.cup(rng, place(x + 0.33, y - 0.15, 0.8, top), "#dfe5e3"),
        *stock.shavings(rng, place(x - 0.2, y - 0.1, 0.0, top), 22, 0.35),
        *storage.crate(rng, place(x - 0.4, y, 0.0, 0.235), (0.55, 0.36, 0.3), "#b98a58"),
        *storage.paint_can(rng, place(x + 0.2, y + 0.05, 0.0, 0.235)),
        *storage.paint_can(rng, place(x + 0.36, y, 1.0, 0.235)),
        *storage.cardboard_box(rng, place(x + 0.62, y + 0.02, 0.06, 0.235), (0.32, 0.3, 0.24)),
    ]


def _rack(rng: Rng) -> list[Part]:
    """Open shelves on the east wall, full of tins, boxes and crates."""
    x, y = SIZE_M[0] - 0.21, 2.35
    parts = storage.bookshelf(rng, place(x, y, EAST), (1.2, 0.4, 1.8), "#9a8f7c", 0.0)
    levels = np.linspace(0.06, 1.788, 6)[:-1] + 0.01
    for k in range(5):
        parts += storage.paint_can(rng, place(x, y - 0.48 + 0.14 * k, rng.uniform(0, 6), levels[3]))
    parts += storage.cardboard_box(rng, place(x, y + 0.36, EAST, levels[3]), (0.3, 0.28, 0.22))
    parts += storage.cardboard_box(rng, place(x, y - 0.35, EAST + 0.05, levels[2]), (0.38, 0.3, 0.24))
    parts += tools.toolbox(rng, place(x, y + 0.22, EAST, levels[2]), "#24507a")
    parts += storage.crate(rng, place(x, y - 0.25, EAST, levels[1]), (0.5, 0.34, 0.26))
    parts += storage.bucket(rng, place(x, y + 0.3, 1.0, levels[1]), "#9fb3b0")
    parts += storage.crate(rng, place(x, y + 0.25, EAST, levels[0]), (0.55, 0.36, 0.28), "#8a5a33")
    parts += storage.cardboard_box(rng, place(x, y - 0.3, EAST, levels[0]), (0.4, 0.34, 0.27))
    parts += storage.crate(rng, place(x, y - 0.32, EAST, levels[4]), (0.45, 0.34, 0.22))
    parts += storage.books(rng, place(x - 0.02, y + 0.5, EAST, levels[4]), 0.32, 0.26, 0.3)
    return parts


def _floor(rng: Rng) -> list[Part]:
    x, y = BENCH_M
    return [
        *seating.stool(rng, place(x + 0.15, y - 0.85, 0.4), "#8a5a33"),
        *storage.bucket(rng, place(x + 0.85, y - 0.62, 2.2), "#33506b"),
        *stock.gas_bottle(rng, place(SIZE_M[0] - 0.2, 3.15)),
        *stock.timber(rng, place(SIZE_M[0] - 0.5, SIZE_M[1] - 0.3)),
        *stock.broom(rng, place(1.2, SIZE_M[1] - 0.24)),
        *storage.crate(rng, place(1.55, y - 0.75, 0.5), (0.5, 0.36, 0.3)),
        *_offcuts(rng, place(1.55, y - 0.75, 0.5, 0.02)),
        *stock.shavings(rng, place(x - 0.3, y - 0.65), 70, 0.7),
        *storage.waste_bin(rng, place(3.75, 3.35), "#4a5357"),
    ]


def _offcuts(rng: Rng, T_world: np.ndarray) -> list[Part]:
    """Short ends of planks in a crate."""
    parts = []
    for k in range(7):
        length, tone = rng.uniform(0.3, 0.55), ("#d2b083", "#c29a63", "#b98a58")[k % 3]
        spot = T_world @ place((k - 3) * 0.055, rng.normal(0.0, 0.05), rng.normal(0.0, 0.2))
        size = (rng.uniform(0.02, 0.045), rng.uniform(0.06, 0.1), length)
        timber = wood(rng, tone, along=2)
        parts.append(board(size, timber, spot, (0.0, 0.0, length / 2), (rng.normal(0, 0.1), 0.0, 0.0)))
    return parts
