"""Lamps, whose parts only glow: to light a room, its scene needs a ``Light`` at the bulb."""

from __future__ import annotations

import numpy as np

from lab.worlds.furniture.finishes import PAINTS, black_plastic, chrome, enamel, glow, painted, pick, steel
from lab.worlds.furniture.placing import ORIGIN, place, solid
from lab.worlds.primitives import cylinder, lathe, merged, moved, sphere, transformed, tube
from lab.worlds.scene import Part, Rng
from pipeline.kernels.geometry import rigid, rotation_exp
from pipeline.types import FloatArray


def floor_lamp(rng: Rng, T_world: FloatArray = ORIGIN, height_m: float = 1.6) -> list[Part]:
    """A chrome stand with a round foot and a linen shade."""
    foot = lathe([(0.14, 0.0), (0.145, 0.008), (0.14, 0.02), (0.02, 0.03), (0.012, 0.04)], 40, 0.002)
    pole = cylinder(0.011, height_m - 0.12, 16)
    return [
        solid(merged([foot, moved(pole, z_m=0.02)]), chrome(), T_world),
        *_shade(T_world @ place(0.0, 0.0, 0.0, height_m - 0.3), 0.15, 0.21, 0.27),
    ]


def table_lamp(rng: Rng, T_world: FloatArray = ORIGIN, color: str | None = None) -> list[Part]:
    """A bellied ceramic foot with a small shade, 0.45 m high."""
    clay = painted(rng, pick(rng, PAINTS, color), 0.3)
    height = np.linspace(0.0, 1.0, 13)
    belly = 0.03 + 0.055 * np.sin(np.pi * np.minimum(1.0, height * 1.15 + 0.18)) ** 1.5
    foot = lathe(np.stack([belly, 0.22 * height], axis=1), 32)
    return [
        solid(foot, clay, T_world),
        solid(cylinder(0.008, 0.08), steel(rng), T_world, (0.0, 0.0, 0.215)),
        *_shade(T_world @ place(0.0, 0.0, 0.0, 0.27), 0.09, 0.14, 0.18),
    ]


def pendant_lamp(rng: Rng, T_world: FloatArray = ORIGIN, color: str | None = None) -> list[Part]:
    """A metal dome on a cable; the origin is on the ceiling, one metre above the dome's rim."""
    shell = enamel(pick(rng, PAINTS, color))
    outside = [(0.2, 0.0), (0.185, 0.06), (0.13, 0.13), (0.05, 0.17), (0.028, 0.2)]
    inside = [(0.024, 0.196), (0.046, 0.166), (0.126, 0.126), (0.181, 0.058), (0.196, 0.0), (0.2, 0.0)]
    dome = lathe([*outside, *inside], 40)
    drop = 1.0
    cable = [moved(cylinder(0.004, drop - 0.18, 8), z_m=-drop + 0.18), moved(cylinder(0.05, 0.03), z_m=-0.03)]
    return [
        solid(dome, shell, T_world, (0.0, 0.0, -drop)),
        solid(merged(cable), black_plastic(), T_world),
        solid(sphere(0.045, 20), glow("#ffe2b0", 6.0), T_world, (0.0, 0.0, -drop + 0.07)),
    ]


def desk_lamp(rng: Rng, T_world: FloatArray = ORIGIN, color: str | None = None) -> list[Part]:
    """An architect's lamp: a heavy foot, two arms and a cone that is open downwards and towards -y."""
    paint = painted(rng, pick(rng, PAINTS, color), 0.25)
    elbow, head = np.array([0.0, 0.14, 0.36]), np.array([0.0, -0.16, 0.5])
    arms = []
    for shift in ([-0.008, 0.0, 0.0], [0.008, 0.0, 0.0]):
        arms.append(tube([[*shift[:2], 0.03], elbow + shift], 0.0045, 8))
        arms.append(tube([elbow + shift, head + shift], 0.0045, 8))
    lying = rotation_exp(np.array([0.0, np.pi / 2.0, 0.0]))
    pin = cylinder(0.014, 0.036, 16)
    arms += [transformed(pin, rigid(lying, p - [0.018, 0.0, 0.0])) for p in (elbow, head)]
    inside = [(0.0, 0.028), (0.022, 0.025), (0.027, -0.02), (0.072, -0.13)]
    cone = lathe([*inside, (0.075, -0.13), (0.03, -0.02), (0.026, 0.03), (0.0, 0.035)], 32)
    at = T_world @ rigid(rotation_exp(np.array([-0.45, 0.0, 0.0])), head)
    return [
        solid(lathe([(0.09, 0.0), (0.09, 0.018), (0.02, 0.028)], 32, 0.004), paint, T_world),
        solid(merged(arms), chrome(), T_world),
        solid(cone, paint, at),
        solid(sphere(0.024, 16), glow("#ffe9c4", 8.0), at, (0.0, 0.0, -0.07)),
    ]


def _shade(T_world: FloatArray, top_m: float, bottom_m: float, height_m: float) -> list[Part]:
    """A drum of cloth around a bulb, open above and below."""
    outside = [(bottom_m, 0.0), (top_m, height_m)]
    inside = [(top_m - 0.003, height_m), (bottom_m - 0.003, 0.0)]
    return [
        solid(lathe([*outside, *inside, outside[0]], 48, 0.001), glow("#f3d6a6", 2.6), T_world),
        solid(sphere(0.035, 20), glow("#ffe6bf", 7.0), T_world, (0.0, 0.0, height_m * 0.45)),
    ]
