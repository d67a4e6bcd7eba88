"""Hand tools and their wall board."""

from __future__ import annotations

import numpy as np

from lab.worlds.furniture.finishes import WOODS, black_plastic, painted, pick, steel, wood
from lab.worlds.furniture.placing import ORIGIN, board, place, solid
from lab.worlds.primitives import cylinder, extrude, frustum, lathe, merged, moved, rounded_box, tube
from lab.worlds.scene import Part, Rng
from pipeline.types import FloatArray

HANDLES = ("#b8322a", "#d98a1f", "#24507a", "#2d2d2f", "#2f6b45")
_UPRIGHT = (np.pi / 2.0, 0.0, 0.0)


def hammer(rng: Rng, T_world: FloatArray = ORIGIN) -> list[Part]:
    """A hammer hanging head up against a wall; the origin is under its head."""
    lower = [(-0.06, 0.0), (-0.02, -0.008), (0.02, -0.012), (0.055, -0.014)]
    head = extrude([*lower, (0.055, 0.016), (0.02, 0.014), (-0.02, 0.012)], 0.026)
    shaft = lathe([(0.013, -0.29), (0.015, -0.2), (0.01, -0.08), (0.011, 0.01)], 16)
    return [
        solid(head, steel(rng, "#4c4f52"), T_world, (0.0, -0.012, 0.0), _UPRIGHT, smooth=False),
        solid(shaft, wood(rng, pick(rng, WOODS[:3]), along=2), T_world, (0.0, -0.025, 0.0)),
    ]


def saw(rng: Rng, T_world: FloatArray = ORIGIN) -> list[Part]:
    """A hand saw, its blade along +x."""
    teeth = [(0.012 * k, -0.045 + 0.0022 * k - 0.004 * (k % 2)) for k in range(31)]
    blade = extrude([*teeth, (0.37, 0.045), (0.0, 0.055)], 0.0015)
    below = [(-0.11, -0.06), (-0.085, -0.075), (-0.07, -0.045), (0.0, -0.05), (0.025, 0.02)]
    above = [(0.0, 0.06), (-0.1, 0.065), (-0.12, 0.03), (-0.08, 0.02), (-0.085, -0.02)]
    grip = extrude([*below, *above], 0.024)
    return [
        solid(blade, steel(rng, "#a7abae"), T_world, (0.0, -0.019, 0.0), _UPRIGHT, smooth=False),
        solid(grip, wood(rng, WOODS[1]), T_world, (0.0, -0.008, 0.0), _UPRIGHT, smooth=False),
    ]


def spanner(rng: Rng, T_world: FloatArray, length_m: float) -> list[Part]:
    """An open-ended spanner, hanging down from the origin."""
    right = np.array([(0.05, -0.86), (0.055, -0.16), (0.11, -0.08), (0.1, 0.02), (0.05, 0.04), (0.05, -0.05)])
    left = right[::-1] * [-1.0, 1.0]
    jaw = extrude(length_m * np.concatenate([left[-1:], right, left[:-1]]), 0.006)
    section = np.array([(0.05, -0.03), (0.09, -0.03), (0.09, 0.03), (0.05, 0.03), (0.05, -0.03)])
    ring = lathe(length_m * section, 20)
    metal = steel(rng, "#9a9ea2", 1)
    return [
        solid(jaw, metal, T_world, (0.0, -0.012, 0.0), _UPRIGHT, smooth=False),
        solid(ring, metal, T_world, (0.0, -0.015, -0.92 * length_m), _UPRIGHT),
    ]


def screwdriver(rng: Rng, T_world: FloatArray, length_m: float) -> list[Part]:
    """A screwdriver, hanging blade down from its handle."""
    grip = [(0.009, -0.09), (0.012, -0.085), (0.011, -0.07), (0.015, -0.05), (0.015, -0.01), (0.01, 0.0)]
    blade = moved(cylinder(0.0032, length_m - 0.085, 8), z_m=-length_m)
    return [
        solid(lathe(grip, 12), painted(rng, pick(rng, HANDLES), 0.3), T_world, (0.0, -0.022, 0.0)),
        solid(blade, steel(rng), T_world, (0.0, -0.022, 0.0)),
    ]


def pliers(rng: Rng, T_world: FloatArray = ORIGIN) -> list[Part]:
    """Pliers, hanging jaws up with open handles."""
    arm = [(0.006, -0.02, 0.0), (0.024, -0.02, -0.05), (0.03, -0.02, -0.09), (0.02, -0.02, -0.14)]
    arms = [tube(np.array(arm) * [s, 1.0, 1.0], [0.006, 0.0075, 0.0075, 0.006], 8) for s in (-1, 1)]
    jaw = [(0.016, -0.01), (0.012, 0.02), (0.005, 0.055)]
    jaws = extrude([(-0.016, -0.01), *jaw, (-0.005, 0.055), (-0.012, 0.02)], 0.014)
    return [
        solid(merged(arms), painted(rng, pick(rng, HANDLES), 0.25), T_world),
        solid(jaws, steel(rng, "#5a5d60"), T_world, (0.0, -0.013, 0.0), _UPRIGHT, smooth=False),
    ]


def square(rng: Rng, T_world: FloatArray = ORIGIN) -> list[Part]:
    """A carpenter's square: wooden stock, steel blade."""
    return [
        board((0.17, 0.02, 0.04), wood(rng, WOODS[3]), T_world, (0.085, -0.02, 0.0), edge_m=0.002),
        board((0.038, 0.003, 0.26), steel(rng, "#b4b6b3", 2), T_world, (0.02, -0.02, -0.13)),
    ]


def tool_board(rng: Rng, T_world: FloatArray = ORIGIN) -> list[Part]:
    """A painted board with hanging tools; the origin is the middle of its lower edge, on the wall."""
    width, height = 1.6, 0.85
    back = painted(rng, "#d6d1c4")
    parts = [board((width, 0.018, height), back, T_world, (0.0, -0.01, height / 2), edge_m=0.003)]
    face = T_world @ place(0.0, -0.019)
    left, right, high, low = -width / 2, width / 2, height * 0.84, height * 0.42
    for k, length in enumerate((0.15, 0.18, 0.21, 0.25, 0.29)):
        parts += spanner(rng, face @ place(left + 0.1 + 0.085 * k, 0.0, 0.0, high), length)
    for k, length in enumerate((0.17, 0.2, 0.24, 0.22, 0.27)):
        parts += screwdriver(rng, face @ place(left + 0.1 + 0.06 * k, 0.0, 0.0, low + 0.03), length)
    for tool, x, z in (
        (hammer, left + 0.62, high - 0.02),
        (hammer, left + 0.76, high - 0.05),
        (saw, right - 0.46, high - 0.06),
        (saw, right - 0.48, high - 0.25),
        (pliers, left + 0.48, low),
        (pliers, left + 0.58, low),
        (square, left + 0.72, low + 0.02),
        (tape_roll, right - 0.3, low - 0.1),
    ):
        parts += tool(rng, face @ place(x, 0.0, 0.0, z))
    return parts


def tape_roll(rng: Rng, T_world: FloatArray = ORIGIN) -> list[Part]:
    """A roll of tape on a peg, and a coil of cable next to it."""
    roll = lathe([(0.038, 0.0), (0.055, 0.0), (0.055, 0.045), (0.038, 0.045), (0.038, 0.0)], 32, 0.001)
    turns = np.linspace(0.0, 10.0 * np.pi, 121)
    radius = 0.085 + 0.006 * np.sin(1.7 * turns)
    x, z = 0.17 + radius * np.cos(turns), 1.12 * radius * np.sin(turns)
    coil = np.stack([x, -0.012 - 0.0016 * turns, z], axis=1)
    return [
        solid(roll, painted(rng, pick(rng, HANDLES), 0.2), T_world, turn_rad=_UPRIGHT),
        solid(tube(coil, 0.005, 7), painted(rng, "#d4661c", 0.15), T_world),
    ]


def toolbox(rng: Rng, T_world: FloatArray = ORIGIN, color: str | None = None) -> list[Part]:
    """A sheet-metal toolbox with a handle and two catches."""
    paint = painted(rng, pick(rng, ("#a8231f", "#24507a", "#d98a1f"), color), 0.3)
    latch = rounded_box((0.03, 0.01, 0.05), 0.004, steps=1, cells=1)
    latches = merged([moved(latch, x, -0.103, 0.13) for x in (-0.13, 0.13)])
    left, right = ([(s * x, 0, z) for x, z in ((0.09, 0.2), (0.085, 0.235), (0.06, 0.245))] for s in (-1, 1))
    bow = tube([*left, *right[::-1]], 0.008)
    return [
        solid(rounded_box((0.44, 0.2, 0.14), 0.01, steps=2, cells=1), paint, T_world, (0.0, 0.0, 0.07)),
        solid(rounded_box((0.445, 0.205, 0.065), 0.016, steps=2, cells=1), paint, T_world, (0.0, 0.0, 0.172)),
        solid(latches, steel(rng), T_world),
        solid(bow, black_plastic(), T_world),
    ]


def drill(rng: Rng, T_world: FloatArray = ORIGIN) -> list[Part]:
    """A cordless drill standing on its battery, chuck towards +x."""
    paint = painted(rng, pick(rng, ("#1f6f78", "#d0a018", "#b3401c")), 0.15)
    body = rounded_box((0.16, 0.062, 0.07), 0.027)
    chuck = frustum(0.024, 0.015, 0.06, 20, 0.002)
    bit = moved(cylinder(0.003, 0.07, 8), z_m=0.06)
    grip, sideways = rounded_box((0.05, 0.042, 0.15), 0.018), (0.0, np.pi / 2.0, 0.0)
    return [
        solid(body, paint, T_world, (0.0, 0.0, 0.2)),
        solid(grip, black_plastic(), T_world, (-0.035, 0.0, 0.11), (0.0, -0.18, 0.0)),
        solid(rounded_box((0.11, 0.075, 0.05), 0.012), black_plastic(), T_world, (-0.02, 0.0, 0.025)),
        solid(merged([chuck, bit]), steel(rng, "#3d4043"), T_world, (0.078, 0.0, 0.2), sideways),
    ]


def plane(rng: Rng, T_world: FloatArray = ORIGIN) -> list[Part]:
    """A wooden smoothing plane."""
    body = rounded_box((0.24, 0.062, 0.06), 0.006, steps=1, cells=1)
    horn = tube([(0.08, 0, 0.05), (0.1, 0, 0.09), (0.085, 0, 0.125)], [0.018, 0.014, 0.01])
    return [
        solid(body, wood(rng, WOODS[2]), T_world, (0.0, 0.0, 0.03), smooth=False),
        solid(horn, wood(rng, WOODS[1], along=2), T_world),
        board((0.006, 0.05, 0.12), steel(rng, "#8b8f93", 2), T_world, (-0.02, 0.0, 0.08), (0.0, -0.7, 0.0)),
    ]
