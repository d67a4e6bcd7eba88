"""Tables, desks and benches."""

from __future__ import annotations

import numpy as np

from lab.worlds.furniture.finishes import PAINTS, WOODS, painted, pick, steel, wood
from lab.worlds.furniture.placing import ORIGIN, board, corners, solid
from lab.worlds.primitives import Vector, frustum, lathe, merged, moved, rounded_box, tube
from lab.worlds.scene import Part, Rng
from pipeline.types import FloatArray


def table(
    rng: Rng, T_world: FloatArray = ORIGIN, size_m: Vector = (1.5, 0.85, 0.74), color: str | None = None
) -> list[Part]:
    """A dining or work table: a wooden top on an apron and four tapered legs."""
    grain = pick(rng, WOODS, color)
    along, upright = wood(rng, grain), wood(rng, grain, along=2)
    width, depth, height = size_m
    x, y = width / 2 - 0.07, depth / 2 - 0.07
    parts = [board((width, depth, 0.032), along, T_world, (0.0, 0.0, height - 0.016), edge_m=0.004)]
    for side in (-1, 1):
        parts.append(board((2 * x - 0.05, 0.02, 0.08), along, T_world, (0.0, side * y, height - 0.072)))
        parts.append(board((0.02, 2 * y - 0.05, 0.08), along, T_world, (side * x, 0.0, height - 0.072)))
    leg = frustum(0.03, 0.042, height - 0.032, segments=4)
    turn = (0.0, 0.0, np.pi / 4.0)
    return parts + [
        solid(leg, upright, T_world, (cx, cy, 0.0), turn, smooth=False) for cx, cy in corners(x, y)
    ]


def coffee_table(
    rng: Rng, T_world: FloatArray = ORIGIN, color: str | None = None, round_top: bool = False
) -> list[Part]:
    """A low table, 0.4 m high, with a shelf underneath, or round on three splayed legs."""
    grain = pick(rng, WOODS, color)
    along, upright = wood(rng, grain), wood(rng, grain, along=2)
    if round_top:
        top = lathe([(0.37, 0.0), (0.4, 0.012), (0.4, 0.03)], 48, 0.003)
        angles = np.arange(3) * 2.0 * np.pi / 3.0 + 0.4
        legs = []
        for c, s in ((np.cos(a), np.sin(a)) for a in angles):
            legs.append(tube([(0.3 * c, 0.3 * s, 0.0), (0.2 * c, 0.2 * s, 0.38)], [0.013, 0.02], 16))
        return [solid(top, along, T_world, (0.0, 0.0, 0.375)), solid(merged(legs), upright, T_world)]
    parts = [
        board((1.05, 0.58, 0.03), along, T_world, (0.0, 0.0, 0.405), edge_m=0.004),
        board((0.93, 0.46, 0.018), along, T_world, (0.0, 0.0, 0.14), edge_m=0.002),
    ]
    leg = (0.045, 0.045, 0.39)
    spots = corners(0.48, 0.245)
    return parts + [board(leg, upright, T_world, (x, y, 0.195), edge_m=0.003) for x, y in spots]


def desk(
    rng: Rng, T_world: FloatArray = ORIGIN, width_m: float = 1.5, color: str | None = None
) -> list[Part]:
    """An office desk: a board on steel legs, with a box of drawers on the right."""
    top = wood(rng, pick(rng, WOODS, color))
    frame = steel(rng, "#3c3f42")
    parts = [board((width_m, 0.75, 0.026), top, T_world, (0.0, 0.0, 0.727), edge_m=0.003)]
    x = width_m / 2 - 0.08
    for side in (-1, 1):
        parts += [board((0.045, 0.045, 0.714), frame, T_world, (side * x, y, 0.357)) for y in (-0.31, 0.31)]
        parts.append(board((0.045, 0.6, 0.045), frame, T_world, (side * x, 0.0, 0.69)))
    parts.append(board((2 * x, 0.03, 0.06), frame, T_world, (0.0, 0.31, 0.67)))
    return parts + _drawers(rng, T_world, x - 0.28)


def _drawers(rng: Rng, T_world: FloatArray, x_m: float) -> list[Part]:
    """A white box of three drawers with steel handles, under a desk."""
    white, handle = painted(rng, PAINTS[0]), steel(rng)
    parts = [board((0.42, 0.55, 0.54), white, T_world, (x_m, 0.02, 0.31))]
    for k, height in enumerate((0.13, 0.13, 0.25)):
        z = 0.57 - sum((0.13, 0.13, 0.25)[:k]) - 0.006 * k - height / 2
        parts.append(board((0.41, 0.018, height), white, T_world, (x_m, -0.264, z), edge_m=0.003))
        parts.append(board((0.13, 0.012, 0.01), handle, T_world, (x_m, -0.285, z + height / 2 - 0.04)))
    return parts


def workbench(
    rng: Rng, T_world: FloatArray = ORIGIN, width_m: float = 1.8, color: str | None = None
) -> list[Part]:
    """A heavy bench, 0.86 m high: thick top, square legs, a low shelf and an iron vice on the left."""
    grain = pick(rng, WOODS[:3], color)
    along, upright = wood(rng, grain), wood(rng, grain * 0.9, along=2)
    iron = steel(rng, "#33506b")
    x, y = width_m / 2 - 0.09, 0.25
    parts = [
        board((width_m, 0.65, 0.06), along, T_world, (0.0, 0.0, 0.83), edge_m=0.004),
        board((2 * x, 0.5, 0.025), along, T_world, (0.0, 0.0, 0.22), edge_m=0.002),
        board((2 * x, 0.03, 0.12), along, T_world, (0.0, -y, 0.73)),
    ]
    leg = (0.09, 0.09, 0.8)
    parts += [board(leg, upright, T_world, (cx, cy, 0.4), edge_m=0.004) for cx, cy in corners(x, y)]
    jaw = rounded_box((0.14, 0.035, 0.1), 0.008, steps=1, cells=1)
    vice = [moved(jaw, 0.0, -0.02, 0.07), moved(jaw, 0.0, 0.06, 0.07)]
    vice.append(moved(rounded_box((0.1, 0.2, 0.06), 0.015, steps=2, cells=1), 0.0, 0.06, 0.04))
    parts.append(solid(merged(vice), iron, T_world, (-x + 0.1, -0.24, 0.86), smooth=False))
    screw = [tube([(0, 0, 0), (0, -0.16, 0)], 0.011), tube([(-0.1, -0.15, 0.02), (0.1, -0.15, -0.02)], 0.006)]
    return [*parts, solid(merged(screw), steel(rng), T_world, (-x + 0.1, -0.26, 0.91))]
