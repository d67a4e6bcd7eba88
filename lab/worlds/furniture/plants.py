"""Potted plants."""

from __future__ import annotations

import numpy as np

from lab.worlds.furniture.finishes import leaf, pick, plain
from lab.worlds.furniture.placing import ORIGIN, solid
from lab.worlds.primitives import Mesh, lathe, merged, quads_of, thickened, transformed, tube
from lab.worlds.scene import Part, Rng
from lab.worlds.textures.mixing import linear
from pipeline.kernels.geometry import rigid, rotation_exp
from pipeline.types import FloatArray

POTS = ("#a65a3a", "#e6e1d6", "#4a5357", "#c9b28a", "#8fa79b")


def potted_plant(
    rng: Rng, T_world: FloatArray = ORIGIN, height_m: float = 1.1, color: str | None = None, leaves: int = 26
) -> list[Part]:
    """A leafy plant (rubber tree or fig): three stems in a pot, with broad leaves in a spiral."""
    pot_m = float(np.clip(0.16 * height_m, 0.06, 0.17))
    stems, blades = [], []
    for k in range(3):
        heading, lean = k * 2.1 + rng.uniform(0.0, 0.6), rng.uniform(0.08, 0.25)
        t = np.linspace(0.0, 1.0, 9)
        out = (0.25 * pot_m + lean * height_m * t**1.6)[:, None] * [np.cos(heading), np.sin(heading)]
        top = height_m * rng.uniform(0.72, 0.92)
        path = np.column_stack([out, pot_m * 1.5 + (top - pot_m * 1.5) * t])
        stems.append(tube(path, np.linspace(0.011, 0.004, 9) * min(1.0, height_m), 8))
        for j in range(leaves // 3):
            along = 0.3 + 0.7 * (j + 0.5) / (leaves // 3)
            root = np.array([np.interp(along, t, path[:, axis]) for axis in range(3)])
            length = height_m * rng.uniform(0.17, 0.26) * (1.15 - 0.4 * along)
            droop = rng.uniform(0.25, 0.9) - 0.9 * along
            blades.append(_leaf_at(root, j * 2.4 + rng.normal(0.0, 0.3), droop, length, 0.5 * length))
    return [*_pot(rng, T_world, pot_m, color), *_foliage(rng, T_world, stems, blades, "#3f6b34")]


def grass_plant(
    rng: Rng, T_world: FloatArray = ORIGIN, height_m: float = 0.5, color: str | None = None, leaves: int = 24
) -> list[Part]:
    """A tuft of long arching blades (spider plant, snake plant) for shelves and tables."""
    pot_m = float(np.clip(0.2 * height_m, 0.05, 0.13))
    blades = []
    for k in range(leaves):
        root = np.array([*(rng.normal(0.0, 0.25 * pot_m, 2)), 1.5 * pot_m])
        length = height_m * rng.uniform(0.6, 1.0)
        blades.append(_leaf_at(root, k * 2.4, rng.uniform(-1.4, -0.75), length, 0.055 * height_m))
    return [*_pot(rng, T_world, pot_m, color), *_foliage(rng, T_world, [], blades, "#6f8f4e")]


def _pot(rng: Rng, T_world: FloatArray, radius_m: float, color: str | None) -> list[Part]:
    """A tapered pot with a rim, filled with earth."""
    clay = plain(pick(rng, POTS, color), 0.1)
    profile = np.array(
        [(0.72, 0), (0.95, 1.4), (1.0, 1.4), (1.0, 1.6), (0.92, 1.6), (0.9, 1.45), (0.0, 1.45)]
    )
    pot = solid(lathe(radius_m * profile, 40, 0.003), clay, T_world)
    soil = lathe(radius_m * np.array([(0.88, 1.42), (0.88, 1.48), (0.4, 1.52)]), 24)
    return [pot, solid(soil, plain("#2c211a"), T_world)]


def _foliage(rng: Rng, T_world: FloatArray, stems: list[Mesh], blades: list[Mesh], color: str) -> list[Part]:
    """Stems and leaves in three greens."""
    parts = [solid(merged(stems), plain("#6b5a3a"), T_world)] if stems else []
    for k in range(3):
        green = linear(color) * rng.uniform(0.75, 1.25) * [1.0 + 0.12 * (k - 1), 1.0, 1.0]
        parts.append(solid(merged(blades[k::3]), leaf(rng, green), T_world))
    return parts


def _leaf_at(
    root_m: FloatArray, heading_rad: float, droop_rad: float, length_m: float, width_m: float
) -> Mesh:
    """One pointed leaf that starts at ``root_m``, bent along its length and folded along its middle."""
    t = np.linspace(0.0, 1.0, 8)
    half = width_m / 2.0 * np.sin(np.pi * (0.03 + 0.97 * t) ** 0.8) ** 0.9 + 0.001
    across = np.array([-1.0, -0.5, 0.0, 0.5, 1.0])
    bend = 0.55 * length_m * t**2
    x = np.broadcast_to((length_m * t)[:, None], (8, 5))
    y = half[:, None] * across
    z = 0.25 * np.abs(y) - bend[:, None]
    top = np.stack([x, y, z], axis=-1).reshape(-1, 3)
    index = np.arange(40).reshape(8, 5)
    rim = np.concatenate([index[:-1, 0], index[-1, :-1], index[:0:-1, -1], index[0, :0:-1]])
    blade = thickened(top, quads_of(index)[:, [0, 3, 2, 1]], rim, 0.002)
    pitch = rotation_exp(np.array([0.0, droop_rad, 0.0]))
    turn = rotation_exp(np.array([0.0, 0.0, heading_rad]))
    return transformed(blade, rigid(turn, root_m) @ rigid(pitch, np.zeros(3)))
