"""An office on a grey day: a desk with screens in a corner, a swivel chair, a window, shelves of books."""

from __future__ import annotations

import numpy as np

from lab.worlds import textures
from lab.worlds.furniture import electronics, fixtures, lights, plants, seating, storage, tables, things
from lab.worlds.furniture.finishes import glow, painted, plain
from lab.worlds.furniture.placing import board, place
from lab.worlds.scene import Light, Material, Part, Rng, Scene
from lab.worlds.staging import EAST, NORTH, SOUTH, VGA, WALL_M, WEST, arc, shell

SIZE_M = (4.3, 4.0, 2.7)
WINDOW = (0.75, 0.95, 1.5, 1.35)
DESK_M = (1.72, SIZE_M[1] - 0.43)


def office() -> Scene:
    """Return the scene; all random choices are seeded."""
    rng = np.random.default_rng(23)
    return Scene(
        "office",
        (*_room(rng), *_desk(rng), *_floor(rng), *_shelves(rng)),
        (
            Light(np.array([0.25, 2.75, 1.7]), np.array([2.3, 2.45, 2.6]), 0.5),
            Light(np.array([2.4, 1.9, 2.5]), np.array([3.6, 3.5, 3.3]), 0.4),
            Light(np.array([2.3, 3.45, 1.08]), np.array([0.35, 0.27, 0.17]), 0.04),
        ),
        np.array([0.24, 0.25, 0.26]),
        arc((1.62, 3.15, 0.9), 2.3, 1.5, (-90.0, -65.0, -40.0)),
        VGA,
    )


def _room(rng: Rng) -> list[Part]:
    wall = Material(textures.plaster("#e6e4dc", 6, 0.01, 0.04))
    blue = Material(textures.plaster("#b9c4c8", 7, 0.01, 0.04))
    floor = Material(textures.carpet("#575c66", 8, 0.012, 0.35))
    ceiling = Material(textures.tiles("#efefeb", "#b5b5b0", 9, 0.6, 0.03))
    panel = board((1.2, 0.3, 0.03), glow("#fff6e6", 3.0), place(2.4, 1.9, 0.0, SIZE_M[2]))
    return [
        *shell(rng, SIZE_M, floor, (wall, wall, wall, blue), ceiling, {WEST: WINDOW}, "#8d9092"),
        *fixtures.window(rng, place(0.0, 2.75, WEST, 0.95), (1.5, 1.35), 1.7, recess_m=WALL_M - 0.04),
        *fixtures.radiator(rng, place(0.0, 2.75, WEST), 1.3, 0.6),
        *fixtures.door(rng, place(3.3, 0.0, SOUTH), "#a8754a"),
        panel,
    ]


def _desk(rng: Rng) -> list[Part]:
    x, y = DESK_M
    top = 0.74
    return [
        *tables.desk(rng, place(x, y), 1.6, "#c9a06c"),
        *electronics.monitor(rng, place(x - 0.22, y + 0.16, 0.2, top), 0.56, lit=True),
        *electronics.monitor(rng, place(x + 0.36, y + 0.16, -0.2, top), 0.56),
        *electronics.keyboard(rng, place(x + 0.03, y - 0.16, 0.05, top)),
        *electronics.mouse(rng, place(x + 0.36, y - 0.18, 0.1, top)),
        *electronics.laptop(rng, place(x - 0.6, y - 0.1, 0.5, top), lit=False),
        *lights.desk_lamp(rng, place(x + 0.68, y + 0.1, -0.5, top), "#c7653f"),
        *things.papers(rng, place(x + 0.58, y - 0.2, 0.3, top), 6),
        *things.cup(rng, place(x - 0.3, y - 0.2, 2.5, top), "#f2efe8"),
        *things.pen_pot(rng, place(x - 0.62, y + 0.22, 0.0, top), "#2f5d73"),
        *things.book_pile(rng, place(x - 0.4, y + 0.25, 0.2, top), 2),
        *_pinboard(rng, x + 0.05),
        *fixtures.wall_clock(rng, place(x + 1.05, SIZE_M[1], NORTH, 2.0)),
    ]


def _pinboard(rng: Rng, x_m: float) -> list[Part]:
    cork = Material(textures.patches(["#a87b4f", "#96683d", "#b98d5e"], 10, 0.012))
    T = place(x_m, SIZE_M[1] - 0.02, NORTH, 1.62)
    parts = [board((1.25, 0.02, 0.62), cork, T, (0.0, 0.01, 0.0))]
    frame = painted(rng, "#d9d4c8", 0.2)
    parts += [board((1.29, 0.03, 0.02), frame, T, (0.0, 0.005, z)) for z in (-0.31, 0.31)]
    parts += [board((0.02, 0.03, 0.62), frame, T, (x, 0.005, 0.0)) for x in (-0.635, 0.635)]
    spots = [(-0.48, 0.06), (-0.22, -0.1), (0.05, 0.1), (0.3, -0.04), (0.5, 0.12)]
    for x, z in spots:
        tilt = np.eye(4)
        angle = rng.normal(0.0, 0.05)
        tilt[0, 0] = tilt[2, 2] = np.cos(angle)
        tilt[0, 2], tilt[2, 0], tilt[0, 3], tilt[2, 3] = np.sin(angle), -np.sin(angle), x, z
        parts += fixtures.note(rng, T @ tilt, (0.21, 0.297) if x != 0.05 else (0.297, 0.21))
    for x, z, color in ((-0.3, 0.19, "#e3c15a"), (0.18, -0.2, "#d98f9b"), (0.44, -0.19, "#8fc0c9")):
        parts.append(board((0.076, 0.002, 0.076), plain(color), T, (x, -0.001, z)))
    return parts


def _floor(rng: Rng) -> list[Part]:
    x, y = DESK_M
    return [
        *seating.office_chair(rng, place(x - 0.62, y - 0.78, np.pi - 0.75), "#4d6676"),
        *storage.waste_bin(rng, place(x + 0.42, y - 0.62), "#8f9aa0"),
        *storage.cardboard_box(rng, place(0.42, 1.75, 1.4), (0.4, 0.3, 0.26)),
        *plants.potted_plant(rng, place(0.38, 3.62), 1.35, "#e6e1d6", 30),
    ]


def _shelves(rng: Rng) -> list[Part]:
    shelf = place(3.2, SIZE_M[1] - 0.16, NORTH)
    return [
        *storage.bookshelf(rng, shelf, (1.0, 0.31, 1.85), "#e9e4d8", 0.8),
        *things.globe(rng, place(3.0, SIZE_M[1] - 0.18, 0.4, 1.85), 0.13),
        *storage.cardboard_box(rng, place(3.45, SIZE_M[1] - 0.18, 0.1, 1.85), (0.34, 0.25, 0.2)),
        *storage.cabinet(rng, place(SIZE_M[0] - 0.24, 2.2, EAST), (1.0, 0.45, 0.75), "#d2d0c8", 2),
    ]
