"""Screens, keyboards, computers: black, shiny and hard on depth sensors."""

from __future__ import annotations

import numpy as np

from lab.worlds.furniture.finishes import black_plastic, painted, plain, screen, steel
from lab.worlds.furniture.placing import ORIGIN, board, corners, place, solid
from lab.worlds.primitives import box, cylinder, merged, moved, rounded_box, tube
from lab.worlds.scene import Part, Rng
from pipeline.types import FloatArray


def television(rng: Rng, T_world: FloatArray = ORIGIN, width_m: float = 1.1, lit: bool = False) -> list[Part]:
    """A flat television on two feet."""
    black, height = black_plastic(0.3), width_m * 0.575
    z = 0.07 + height / 2
    glass, pane = screen(rng, (width_m, height), lit), (width_m - 0.024, 0.002, height - 0.03)
    feet = []
    for x, y in corners(width_m, 0.11):
        feet.append(tube([(0.33 * x, 0.0, 0.09), (0.36 * x, y, 0.008)], 0.008, 8))
    return [
        board((width_m, 0.045, height), black, T_world, (0.0, 0.0, z), edge_m=0.004),
        board(pane, glass, T_world, (0.0, -0.0235, z + 0.003)),
        solid(merged(feet), black, T_world),
    ]


def monitor(rng: Rng, T_world: FloatArray = ORIGIN, width_m: float = 0.56, lit: bool = False) -> list[Part]:
    """A computer monitor on its foot, its lower edge 0.12 m above the desk."""
    black, height = black_plastic(), width_m * 0.6
    z, tilt = 0.12 + height / 2, (-0.05, 0.0, 0.0)
    glass, pane = screen(rng, (width_m, height), lit), (width_m - 0.02, 0.002, height - 0.032)
    return [
        board((width_m, 0.035, height), black, T_world, (0.0, 0.0, z), tilt, 0.004),
        board(pane, glass, T_world, (0.0, -0.0186, z + 0.004), tilt),
        board((0.07, 0.03, 0.3), black, T_world, (0.0, 0.05, 0.15), (0.12, 0.0, 0.0), 0.004),
        board((0.24, 0.2, 0.014), black, T_world, (0.0, 0.03, 0.007), edge_m=0.003),
    ]


def keyboard(rng: Rng, T_world: FloatArray = ORIGIN) -> list[Part]:
    """A flat keyboard with five rows of keys."""
    keys = []
    for row in range(5):
        for column in range(15 if row < 4 else 9):
            wide = 0.016 if row < 4 else (0.1 if column == 4 else 0.018)
            x = (column - 7.0) * 0.0285 if row < 4 else (column - 4.0) * 0.038 + np.sign(column - 4) * 0.045
            keys.append(moved(box((wide + 0.008, 0.019, 0.006)), x, 0.048 - 0.024 * row, 0.019))
    return [
        board((0.45, 0.145, 0.016), black_plastic(), T_world, (0.0, 0.0, 0.008), edge_m=0.003),
        solid(merged(keys), plain("#2a2b2d", 0.1, infrared=0.4), T_world, smooth=False),
    ]


def mouse(rng: Rng, T_world: FloatArray = ORIGIN) -> list[Part]:
    """A computer mouse."""
    body = rounded_box((0.06, 0.105, 0.036), 0.017, 0.004)
    return [solid(body, black_plastic(), T_world, (0.0, 0.0, 0.018))]


def laptop(rng: Rng, T_world: FloatArray = ORIGIN, lit: bool = True) -> list[Part]:
    """An open laptop of grey metal."""
    shell, pad = steel(rng, "#9a9da0"), steel(rng, "#85888b")
    lid, y, lean = T_world @ place(0.0, 0.115, 0.0, 0.016), 0.11 * np.sin(0.25), (-0.25, 0.0, 0.0)
    keys = []
    for r, c in np.ndindex(5, 14):
        keys.append(moved(box((0.0175, 0.016, 0.002)), 0.0195 * (c - 6.5), 0.075 - 0.019 * r, 0.017))
    return [
        board((0.34, 0.235, 0.015), shell, T_world, (0.0, 0.0, 0.0085), edge_m=0.003),
        solid(merged(keys), plain("#1c1d1f", 0.1, infrared=0.4), T_world, smooth=False),
        board((0.1, 0.06, 0.001), pad, T_world, (0.0, -0.072, 0.0162)),
        board((0.34, 0.007, 0.23), shell, lid, (0.0, y, 0.112), lean, 0.002),
        board((0.324, 0.002, 0.21), screen(rng, (0.33, 0.21), lit), lid, (0.0, y - 0.0042, 0.113), lean),
    ]


def tablet(rng: Rng, T_world: FloatArray = ORIGIN) -> list[Part]:
    """A tablet computer that lies on its back, its screen off."""
    glass = screen(rng, (0.24, 0.16), lit=False)
    return [
        board((0.25, 0.175, 0.007), steel(rng, "#6d7073"), T_world, (0.0, 0.0, 0.0035), edge_m=0.002),
        board((0.24, 0.163, 0.001), glass, T_world, (0.0, 0.0, 0.0072)),
    ]


def speaker(rng: Rng, T_world: FloatArray = ORIGIN, height_m: float = 0.3) -> list[Part]:
    """A loudspeaker with two dark cones."""
    cones = []
    for z, radius in ((0.34, 0.3), (0.75, 0.16)):
        vertices, triangles = cylinder(radius * height_m, 0.006)
        forwards = vertices[:, [0, 2, 1]] * [1.0, -1.0, 1.0]
        cones.append(moved((forwards, triangles), 0.0, -0.32 * height_m, z * height_m))
    size, timber = (0.62 * height_m, 0.64 * height_m, height_m), painted(rng, "#4a3326", 0.15)
    return [
        board(size, timber, T_world, (0, 0, height_m / 2), edge_m=0.004),
        solid(merged(cones), black_plastic(0.1), T_world, smooth=False),
    ]
