"""Objects in a workshop: timber, shavings, a broom, a gas bottle."""

from __future__ import annotations

import numpy as np

from lab.worlds.furniture.finishes import WOODS, painted, pick, plain, steel, wood
from lab.worlds.furniture.placing import ORIGIN, board, place, solid
from lab.worlds.primitives import box, cylinder, lathe, merged, moved, transformed, tube
from lab.worlds.scene import Part, Rng
from pipeline.types import FloatArray


def timber(rng: Rng, T_world: FloatArray = ORIGIN) -> list[Part]:
    """Five planks of uneven length that lean against a wall behind them; the origin is at their foot."""
    parts = []
    for k in range(5):
        length, wide = 2.1 * rng.uniform(0.75, 1.0), rng.uniform(0.09, 0.16)
        lean = rng.uniform(0.1, 0.16)
        back_m, up_m = 0.5 * length * np.sin(lean), 0.5 * length * np.cos(lean)
        at = ((k - 2.5) * 0.15, back_m - 0.04 * (k % 2), up_m + 0.002)
        plank = wood(rng, pick(rng, WOODS[:3]), along=2, gloss=0.03)
        parts.append(board((wide, 0.022, length), plank, T_world, at, (-lean, 0.0, 0.0), 0.001))
    return parts


def shavings(rng: Rng, T_world: FloatArray = ORIGIN, count: int = 25, spread_m: float = 0.3) -> list[Part]:
    """Curled wood shavings on the floor or on a bench."""
    kinds = []
    for turn, radius in zip(rng.uniform(3.0, 9.0, 6), rng.uniform(0.006, 0.012, 6), strict=True):
        turns = np.linspace(0.0, turn, 12)
        x, z = radius * np.cos(turns), radius * np.sin(turns) + radius + 0.003
        path = np.stack([x, 0.003 * turns, z], axis=1)
        kinds.append(tube(path, 0.0022, 5))
    spots, headings = rng.normal(0.0, spread_m / 2.0, (count, 2)), rng.uniform(0.0, 2.0 * np.pi, count)
    curls = [transformed(kinds[k % 6], place(x, y, headings[k])) for k, (x, y) in enumerate(spots)]
    return [solid(merged(curls), plain("#dcbf8d"), T_world)]


def broom(rng: Rng, T_world: FloatArray = ORIGIN) -> list[Part]:
    """A broom that leans against a wall behind it, bristles down."""
    stick = wood(rng, WOODS[2], along=2)
    return [
        solid(cylinder(0.012, 1.35, 12), stick, T_world, (0.0, 0.0, 0.12), (-0.12, 0.0, 0.0)),
        board((0.36, 0.06, 0.035), wood(rng, WOODS[0]), T_world, (0.0, 0.0, 0.11), edge_m=0.004),
        board((0.34, 0.05, 0.095), plain("#3b2a1c"), T_world, (0.0, 0.0, 0.048)),
    ]


def gas_bottle(rng: Rng, T_world: FloatArray = ORIGIN) -> list[Part]:
    """A steel gas cylinder with its collar, 0.6 m high."""
    paint = painted(rng, "#c7653f", 0.25)
    body = [(0.11, 0.0), (0.13, 0.03), (0.135, 0.06), (0.135, 0.36), (0.12, 0.43), (0.07, 0.47), (0.02, 0.48)]
    collar = lathe([(0.072, 0.46), (0.078, 0.46), (0.078, 0.58), (0.072, 0.58), (0.072, 0.46)], 32)
    valve = merged([moved(cylinder(0.02, 0.07), z_m=0.47), moved(box((0.07, 0.02, 0.02)), z_m=0.53)])
    return [
        solid(lathe(body, 32), paint, T_world),
        solid(collar, paint, T_world),
        solid(valve, steel(rng, "#a98a45"), T_world),
    ]
