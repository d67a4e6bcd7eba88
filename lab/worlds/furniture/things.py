"""Small objects on tables and shelves."""

from __future__ import annotations

import numpy as np

from lab.worlds import textures
from lab.worlds.furniture.finishes import (
    BOOKS,
    PAINTS,
    WOODS,
    book,
    ceramic,
    painted,
    pick,
    plain,
    steel,
    wood,
)
from lab.worlds.furniture.placing import ORIGIN, board, place, solid
from lab.worlds.primitives import box, cylinder, lathe, merged, moved, sphere, tube
from lab.worlds.room_finishes import draw_seed
from lab.worlds.scene import Material, Part, Rng
from pipeline.types import FloatArray

FRUITS = ("#b5262a", "#d9822b", "#c8b432", "#7d9a3b", "#c74a2e")


def cup(rng: Rng, T_world: FloatArray = ORIGIN, color: str | None = None) -> list[Part]:
    """A mug with a handle, half full of coffee."""
    glaze = ceramic(pick(rng, PAINTS, color))
    outside = [(0.0, 0.0), (0.034, 0.0), (0.041, 0.012), (0.041, 0.092)]
    wall = lathe([*outside, (0.038, 0.094), (0.037, 0.012), (0.0, 0.008)], 28, 0.001)
    angle = np.linspace(-1.9, 1.9, 13)
    ear = np.stack([0.04 + 0.026 * np.cos(angle), np.zeros(13), 0.05 + 0.03 * np.sin(angle)], axis=1)
    return [
        solid(wall, glaze, T_world),
        solid(tube(ear, 0.0055, 8), glaze, T_world),
        solid(cylinder(0.0365, 0.001, 28), plain("#2a1a10", 0.4), T_world, (0.0, 0.0, 0.06)),
    ]


def bottle(
    rng: Rng, T_world: FloatArray = ORIGIN, color: str | None = None, label: bool = True
) -> list[Part]:
    """A dark wine bottle, 0.3 m high, on whose glass the sensor measures no depth."""
    body = [(0.0, 0.006), (0.03, 0.0), (0.037, 0.006), (0.037, 0.19), (0.03, 0.215)]
    neck = [(0.0145, 0.235), (0.0135, 0.29), (0.016, 0.292), (0.016, 0.302), (0.0, 0.302)]
    glass = plain(color or "#1f3a29", 0.9, infrared=0.1)
    parts = [solid(lathe([*body, *neck], 28, 0.002), glass, T_world)]
    if label:
        paper = Material(textures.paper(draw_seed(rng), 0.012))
        parts.append(solid(cylinder(0.0375, 0.08, 28), paper, T_world, (0.0, 0.0, 0.06)))
    return parts


def vase(
    rng: Rng, T_world: FloatArray = ORIGIN, height_m: float = 0.28, color: str | None = None
) -> list[Part]:
    """A bellied vase with an open neck."""
    t = np.linspace(0.0, 1.0, 15)
    waist = 0.2 + 0.16 * np.sin(np.pi * t**0.8 * rng.uniform(0.95, 1.1)) - 0.1 * t
    outside = np.stack([waist, t], axis=1)
    inside = outside[:3:-1] - [0.02, 0.0]
    profile = height_m * np.concatenate([[(0.0, 0.0)], outside, inside, [(0.0, inside[-1, 1])]])
    return [solid(lathe(profile, 36), ceramic(pick(rng, PAINTS, color)), T_world)]


def fruit_bowl(
    rng: Rng, T_world: FloatArray = ORIGIN, color: str | None = None, fruits: int = 7
) -> list[Part]:
    """A shallow bowl with apples and oranges."""
    arc = np.linspace(0.0, 1.25, 9)
    outside = np.stack([0.15 * np.sin(arc), 0.012 + 0.12 * (1.0 - np.cos(arc))], axis=1)
    inside = outside[::-1] * [0.955, 1.0] + [0.0, 0.006]
    profile = np.concatenate([[(0.0, 0.0), (0.05, 0.0), (0.05, 0.012)], outside[4:], inside])
    parts = [solid(lathe(profile, 40), ceramic(pick(rng, PAINTS, color)), T_world)]
    latitude = np.linspace(0.0, np.pi, 13)
    apple = np.stack([np.sin(latitude) * (1.0 - 0.12 * np.cos(latitude)), -np.cos(latitude) * 0.9], axis=1)
    apple[-1], apple[0] = (0.0, 0.78), (0.0, -0.85)
    for k in range(fruits):
        radius = rng.uniform(0.035, 0.042)
        spread, lift = (0.065, 0.052) if k < fruits - 2 else (0.028, 0.11)
        angle = 2.4 * k + rng.uniform(-0.2, 0.2)
        skin = painted(rng, FRUITS[rng.integers(len(FRUITS))], 0.2)
        turn = (rng.uniform(-0.6, 0.6), rng.uniform(-0.6, 0.6), 0.0)
        at = (spread * np.cos(angle), spread * np.sin(angle), lift)
        parts.append(solid(lathe(radius * apple, 24), skin, T_world, at, turn))
    return parts


def book_pile(rng: Rng, T_world: FloatArray = ORIGIN, count: int = 3) -> list[Part]:
    """A pile of lying books, each a little turned."""
    parts, z = [], 0.0
    for _ in range(count):
        thick, wide, deep = rng.uniform(0.015, 0.035), rng.uniform(0.14, 0.19), rng.uniform(0.2, 0.26)
        # Upright in its own frame (spine to -y, paper on top), then laid on its side.
        T = T_world @ place(0.0, 0.0, rng.normal(0.0, 0.22), z + thick / 2)
        cover = book(rng, BOOKS[rng.integers(len(BOOKS))])
        volume = moved(box((thick, wide, deep)), z_m=deep / 2)
        parts.append(solid(volume, cover, T, (-deep / 2, 0.0, 0.0), (0.0, np.pi / 2.0, 0.0), smooth=False))
        z += thick
    return parts


def papers(rng: Rng, T_world: FloatArray = ORIGIN, count: int = 4) -> list[Part]:
    """Printed sheets in disorder."""
    page = Material(textures.paper(draw_seed(rng)))
    return [
        board((0.21, 0.297, 0.0012), page, T_world @ place(x, y, yaw, 0.0012 * (k + 0.5)))
        for k, (x, y, yaw) in enumerate(rng.normal(0.0, (0.03, 0.03, 0.3), (count, 3)))
    ]


def pen_pot(rng: Rng, T_world: FloatArray = ORIGIN, color: str | None = None) -> list[Part]:
    """A beaker full of pens."""
    wall = [(0.0, 0.0), (0.038, 0.0), (0.038, 0.1), (0.035, 0.1), (0.035, 0.006), (0.0, 0.006)]
    parts = [solid(lathe(wall, 28, 0.001), painted(rng, pick(rng, PAINTS, color), 0.15), T_world)]
    for k in range(6):
        heading, high = k * 1.05 + rng.uniform(0.0, 0.6), rng.uniform(0.14, 0.19)
        out = np.array([np.cos(heading), np.sin(heading)])
        tip = (0.03 + 0.5 * (high - 0.1)) * out
        pen = tube([(*(-0.02 * out), 0.01), (*(0.03 * out), 0.1), (*tip, high)], 0.004, 6)
        parts.append(solid(pen, plain(BOOKS[rng.integers(len(BOOKS))], 0.2), T_world))
    return parts


def globe(rng: Rng, T_world: FloatArray = ORIGIN, radius_m: float = 0.15) -> list[Part]:
    """A globe on a wooden foot, in a brass meridian."""
    colors = [(0.08, 0.2, 0.33), (0.1, 0.25, 0.38), (0.42, 0.4, 0.2), (0.5, 0.38, 0.2)]
    land = textures.patches(colors, draw_seed(rng), 0.16)
    z = radius_m + 0.09
    angle = np.linspace(-np.pi / 2, np.pi / 2, 17)
    arc = (radius_m + 0.012) * np.stack([np.cos(angle), np.zeros(17), np.sin(angle)], axis=1)
    foot = [(0.09, 0.0), (0.09, 0.012), (0.03, 0.025), (0.014, 0.05), (0.012, z - radius_m - 0.008)]
    return [
        solid(sphere(radius_m, 40), Material(land, 0.2), T_world, (0.0, 0.0, z), (0.0, -0.41, 0.0)),
        solid(tube(arc, 0.006, 8), steel(rng, "#a98a45"), T_world, (0.0, 0.0, z), (0.0, -0.41, 0.0)),
        solid(lathe(foot, 32), wood(rng, WOODS[1], along=2), T_world),
    ]


def teapot(rng: Rng, T_world: FloatArray = ORIGIN, color: str | None = None) -> list[Part]:
    """A round teapot; its spout points along +x."""
    glaze = ceramic(pick(rng, PAINTS, color))
    arc = np.linspace(0.35, np.pi - 0.25, 14)
    belly = np.stack([0.085 * np.sin(arc), 0.078 - 0.075 * np.cos(arc)], axis=1)
    knob = [(0.012, 0.158), (0.018, 0.168), (0.012, 0.178)]
    bend = [(0.07, 0, 0.06), (0.11, 0, 0.075), (0.135, 0, 0.115), (0.155, 0, 0.13)]
    spout = tube(bend, [0.02, 0.015, 0.01, 0.009])
    angle = np.linspace(-1.5, 1.5, 11)
    ear = np.stack([-0.075 - 0.045 * np.cos(angle), np.zeros(11), 0.085 + 0.045 * np.sin(angle)], axis=1)
    pot = lathe(np.concatenate([belly, knob]), 36)
    return [solid(merged([pot, spout, tube(ear, 0.007, 8)]), glaze, T_world)]


def blocks(rng: Rng, T_world: FloatArray = ORIGIN, count: int = 5) -> list[Part]:
    """Painted wooden toy blocks, a few on top of others."""
    parts = []
    for k in range(count):
        side, layer = 0.045, int(k >= 3)
        x, z = (k % 3 - 1.0 + 0.5 * layer) * 0.055, (layer + 0.5) * side
        spot = T_world @ place(x, rng.normal(0.0, 0.008), rng.normal(0.0, 0.25), z)
        paint = painted(rng, pick(rng, ("#c0392b", "#2f6fa3", "#d9a62e", "#4d8b4a")), 0.15)
        parts.append(board((side, side, side), paint, spot, edge_m=0.002))
    return parts
