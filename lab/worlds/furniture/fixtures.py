"""Windows, doors, radiators, rugs, pictures, shelves and clocks; wall pieces have their back at y = 0."""

from __future__ import annotations

import numpy as np

from lab.worlds import textures
from lab.worlds.furniture.finishes import FABRICS, PAINTS, WOODS, fabric, painted, pick, steel, wood
from lab.worlds.furniture.placing import ORIGIN, board, place, solid
from lab.worlds.primitives import Vector, box, cylinder, lathe, merged, moved, rounded_box, sheet, tube
from lab.worlds.room_finishes import draw_seed
from lab.worlds.scene import Material, Part, Rng
from pipeline.types import FloatArray


def window(
    rng: Rng,
    T_world: FloatArray = ORIGIN,
    size_m: Vector = (1.4, 1.3),
    brightness: float = 2.5,
    panes: int = 2,
    recess_m: float = 0.0,
) -> list[Part]:
    """A window with an outdoor view, a white frame and a sill; the origin is the middle of its lower edge.

    ``recess_m`` is the distance by which it is set back into a hole of the wall.
    """
    white = painted(rng, PAINTS[0], 0.15)
    width, height = size_m
    view = Material(textures.outdoors(draw_seed(rng)), 0.9, infrared=0.02, emission=brightness)
    parts = [board((width, 0.01, height), view, T_world, (0.0, recess_m - 0.006, height / 2))]
    bar, y = 0.055, recess_m - 0.025
    post, rail = (bar, 0.05, height + bar), (width, 0.048, bar)
    posts = np.linspace(-width / 2, width / 2, panes + 1)
    parts += [board(post, white, T_world, (x, y, height / 2), edge_m=0.004) for x in posts]
    parts += [board(rail, white, T_world, (0.0, y, z), edge_m=0.004) for z in (0.0, height)]
    parts.append(board((width + 0.2, 0.2, 0.03), white, T_world, (0.0, -0.1, -0.045), edge_m=0.004))
    return parts


def curtains(
    rng: Rng,
    T_world: FloatArray = ORIGIN,
    width_m: float = 2.2,
    height_m: float = 2.3,
    color: str | None = None,
) -> list[Part]:
    """A pair of curtains in folds, drawn to the sides, on a rod; the origin is on the floor."""
    cloth = fabric(rng, pick(rng, FABRICS, color))
    each = width_m * (1.0 - 0.65) / 2.0
    parts = []
    for side in (-1, 1):
        folds, phase = rng.uniform(0.085, 0.11), rng.uniform(0.0, 6.0)

        def wave(x: FloatArray, y: FloatArray, folds: float = folds, phase: float = phase) -> FloatArray:
            drop = 0.5 - y / height_m
            swing = np.sin(2.0 * np.pi * x / folds + phase + 0.8 * np.sin(2.2 * drop + phase))
            return (0.028 + 0.014 * drop) * swing

        cells = max(24, round(each / folds * 12))
        mesh = sheet((each, height_m), wave, 0.004, (cells, 8))
        x = side * (width_m - each) / 2.0
        parts.append(solid(mesh, cloth, T_world, (x, -0.1, 0.02 + height_m / 2), (np.pi / 2.0, 0.0, 0.0)))
    reach = width_m / 2 + 0.1
    rod = tube([(-reach, -0.1, height_m + 0.03), (reach, -0.1, height_m + 0.03)], 0.013)
    return [*parts, solid(rod, steel(rng), T_world)]


def door(rng: Rng, T_world: FloatArray = ORIGIN, color: str | None = None) -> list[Part]:
    """A closed panelled door in its frame, with a handle."""
    paint = painted(rng, pick(rng, (PAINTS[0], PAINTS[1], WOODS[0]), color), 0.15)
    parts = [board((0.86, 0.03, 2.02), paint, T_world, (0.0, -0.012, 1.01))]
    post, panels = (0.09, 0.05, 2.11), ((0.5, 0.62), (1.42, 0.9))
    parts += [board(post, paint, T_world, (x, -0.024, 1.055), edge_m=0.006) for x in (-0.47, 0.47)]
    parts.append(board((1.03, 0.05, 0.09), paint, T_world, (0.0, -0.024, 2.08), edge_m=0.006))
    parts += [board((0.62, 0.014, h), paint, T_world, (0.0, -0.03, z), edge_m=0.006) for z, h in panels]
    bend = [(0.36, -0.02, 1.03), (0.36, -0.075, 1.03), (0.34, -0.08, 1.03), (0.25, -0.08, 1.03)]
    plate = moved(box((0.035, 0.008, 0.2)), 0.36, -0.03, 1.0)
    return [*parts, solid(merged([tube(bend, 0.009), plate]), steel(rng), T_world)]


def radiator(
    rng: Rng, T_world: FloatArray = ORIGIN, width_m: float = 1.0, height_m: float = 0.6
) -> list[Part]:
    """A ribbed white radiator, 12 cm above the floor."""
    count = round(width_m / 0.055)
    rib = rounded_box((0.046, 0.09, height_m), 0.02, steps=2, cells=1)
    x, z = width_m / 2, 0.12 + height_m / 2
    ribs = [moved(rib, (k - (count - 1) / 2) * 0.055, -0.09, z) for k in range(count)]
    pipes = [tube([(-x, -0.09, h), (x, -0.09, h)], 0.018) for h in (0.18, height_m + 0.06)]
    inlet = tube([(x, -0.09, 0.18), (x + 0.06, -0.09, 0.16), (x + 0.06, -0.09, 0.0)], 0.01)
    return [solid(merged([*ribs, *pipes, inlet]), painted(rng, PAINTS[0], 0.2), T_world)]


def picture(
    rng: Rng, T_world: FloatArray = ORIGIN, size_m: Vector = (0.6, 0.45), color: str | None = None
) -> list[Part]:
    """A framed painting with a mount; the origin is its middle, on the wall."""
    frame = wood(rng, pick(rng, (*WOODS, "#22201e", "#e9e6df"), color))
    width, height = size_m
    art = Material(textures.painting(draw_seed(rng), 0.6 * min(size_m)), 0.1)
    parts = [
        board((width, 0.012, height), painted(rng, "#efece4"), T_world, (0.0, -0.007, 0.0)),
        board((width * 0.74, 0.004, height * 0.7), art, T_world, (0.0, -0.0145, 0.0)),
    ]
    post, rail = (0.025, 0.028, height + 0.025), (width - 0.025, 0.028, 0.025)
    for s in (-1, 1):
        parts.append(board(post, frame, T_world, (s * width / 2, -0.015, 0.0), edge_m=0.003))
        parts.append(board(rail, frame, T_world, (0.0, -0.015, s * height / 2), edge_m=0.003))
    return parts


def rug(
    rng: Rng, T_world: FloatArray = ORIGIN, size_m: Vector = (2.0, 1.4), colors: tuple[str, ...] | None = None
) -> list[Part]:
    """A woven rug with hardly visible ripples."""
    palette = [pick(rng, FABRICS, c) for c in (colors or (None,) * 4)]
    weave = Material(textures.rug(palette, draw_seed(rng), size_m))
    phase = rng.uniform(0.0, 6.0, 2)

    def ripple(x: FloatArray, y: FloatArray) -> FloatArray:
        return 0.012 + 0.0025 * np.sin(3.1 * x + phase[0]) * np.sin(4.3 * y + phase[1])

    return [solid(sheet(size_m, ripple, 0.008, (24, 18)), weave, T_world)]


def wall_shelf(
    rng: Rng, T_world: FloatArray = ORIGIN, width_m: float = 0.9, color: str | None = None
) -> list[Part]:
    """A board on two brackets; its top is at z = 0."""
    timber = wood(rng, pick(rng, WOODS, color))
    brackets = []
    for x in (-0.36 * width_m, 0.36 * width_m):
        brackets.append(moved(box((0.025, 0.006, 0.16)), x, -0.003, -0.1))
        brackets.append(moved(box((0.025, 0.18, 0.006)), x, -0.09, -0.028))
    return [
        board((width_m, 0.22, 0.025), timber, T_world, (0, -0.11, -0.0125), edge_m=0.002),
        solid(merged(brackets), steel(rng, "#2c2e30"), T_world, smooth=False),
    ]


def wall_clock(rng: Rng, T_world: FloatArray = ORIGIN, radius_m: float = 0.15) -> list[Part]:
    """A round clock that shows three o'clock; the origin is its middle, on the wall."""
    upright = (np.pi / 2.0, 0.0, 0.0)
    r = radius_m
    rim = lathe([(r, 0.0), (r, 0.035), (r - 0.012, 0.035), (r - 0.014, 0.02)], 48, 0.002)
    hour, minute, mark = box((0.06, 0.003, 0.012)), box((0.008, 0.003, 0.1)), box((0.008, 0.002, 0.008))
    hands = [moved(hour, 0.025, -0.026), moved(minute, 0.0, -0.027, 0.045)]
    turns = np.arange(12) * np.pi / 6.0
    marks = [moved(mark, 0.8 * r * np.sin(a), -0.021, 0.8 * r * np.cos(a)) for a in turns]
    return [
        solid(rim, steel(rng, "#3a3c3e"), T_world, turn_rad=upright),
        solid(cylinder(r - 0.012, 0.0205, 48), painted(rng, "#f4f2ea"), T_world, turn_rad=upright),
        solid(merged([*hands, *marks]), painted(rng, "#1b1b1c"), T_world, smooth=False),
    ]


def note(rng: Rng, T_world: FloatArray = ORIGIN, size_m: Vector = (0.21, 0.297)) -> list[Part]:
    """A printed sheet on a wall; the origin is its middle."""
    page = Material(textures.paper(draw_seed(rng)))
    return [board((size_m[0], 0.0015, size_m[1]), page, T_world @ place(0.0, -0.001))]
