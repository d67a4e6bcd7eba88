"""Shelves with books, cabinets, boxes, crates, buckets and bins."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from lab.worlds.furniture.finishes import (
    BOOKS,
    PAINTS,
    WOODS,
    black_plastic,
    book,
    cardboard,
    painted,
    pick,
    plain,
    steel,
    wood,
)
from lab.worlds.furniture.placing import ORIGIN, board, corners, place, solid
from lab.worlds.primitives import (
    Mesh,
    Vector,
    box,
    cylinder,
    frustum,
    lathe,
    merged,
    moved,
    transformed,
    tube,
)
from lab.worlds.scene import Part, Rng
from pipeline.types import FloatArray


def bookshelf(
    rng: Rng,
    T_world: FloatArray = ORIGIN,
    size_m: Vector = (0.9, 0.3, 1.9),
    color: str | None = None,
    fill: float = 0.75,
) -> list[Part]:
    """An open shelf, its back at y = depth / 2, with books along a share ``fill``, 0 to 1, of each board."""
    grain = pick(rng, (*WOODS, PAINTS[0]), color)
    along, upright = wood(rng, grain), wood(rng, grain, along=2)
    width, depth, height = size_m
    levels = max(2, round(height / 0.36))
    side, x, z = (0.022, depth, height), (width - 0.022) / 2, height / 2
    parts = [board(side, upright, T_world, (s * x, 0.0, z), edge_m=0.002) for s in (-1, 1)]
    parts.append(board((width - 0.03, 0.008, height - 0.06), along, T_world, (0.0, depth / 2 - 0.008, z)))
    heights = np.linspace(0.06, height - 0.012, levels + 1)
    shelf = (width - 0.044, depth - 0.004, 0.02)
    parts += [board(shelf, along, T_world, (0.0, 0.0, z), edge_m=0.002) for z in heights]
    for z, above in pairwise(heights):
        room = (width - 0.06, above - z - 0.03)
        parts += books(rng, T_world @ place(-room[0] / 2, 0.0, 0.0, z + 0.01), room[0] * fill, room[1], depth)
    return parts


def books(
    rng: Rng,
    T_world: FloatArray = ORIGIN,
    length_m: float = 0.5,
    tallest_m: float = 0.3,
    depth_m: float = 0.28,
) -> list[Part]:
    """A row of upright books along +x from the origin, spines towards -y; some lean, some follow a gap."""
    by_color: dict[int, list[Mesh]] = {}
    x = 0.005
    while x < length_m:
        thick, deep = rng.uniform(0.015, 0.045), rng.uniform(0.6, 0.75) * depth_m
        high = min(tallest_m, rng.uniform(0.19, 0.29))
        lean = rng.uniform(0.08, 0.2) if rng.random() < 0.06 else 0.0
        if rng.random() < 0.06:
            x += rng.uniform(0.04, 0.15)
        volume = moved(box((thick, deep, high)), thick / 2, -depth_m / 2 + 0.03 + deep / 2, high / 2)
        turn = place(0.0, 0.0)
        turn[[0, 0, 2, 2], [0, 2, 0, 2]] = np.cos(lean), np.sin(lean), -np.sin(lean), np.cos(lean)
        by_color.setdefault(int(rng.integers(len(BOOKS))), []).append(
            moved(transformed(volume, turn), x, 0.0, thick * np.sin(lean))
        )
        x += thick * np.cos(lean) + high * np.sin(lean) + 0.001
    return [solid(merged(row), book(rng, BOOKS[k]), T_world, smooth=False) for k, row in by_color.items()]


def cabinet(
    rng: Rng,
    T_world: FloatArray = ORIGIN,
    size_m: Vector = (1.2, 0.45, 0.8),
    color: str | None = None,
    doors: int = 3,
) -> list[Part]:
    """A cabinet with doors and round knobs, on short legs."""
    grain = pick(rng, (*WOODS, PAINTS[0], PAINTS[3]), color)
    timber, knob = wood(rng, grain), steel(rng, "#b59a5b")
    width, depth, height = size_m
    body = height - 0.12
    parts = [
        board((width - 0.012, depth - 0.02, body), timber, T_world, (0.0, 0.01, 0.12 + body / 2)),
        board((width, depth, 0.022), timber, T_world, (0.0, 0.0, height - 0.011), edge_m=0.003),
    ]
    pitch = (width - 0.02) / doors
    knobs = []
    for k in range(doors):
        x = (k - (doors - 1) / 2) * pitch
        front = (pitch - 0.006, 0.018, body - 0.04)
        parts.append(board(front, timber, T_world, (x, -depth / 2 + 0.006, 0.11 + body / 2), edge_m=0.002))
        side = 1 if k % 2 == 0 else -1
        ball = lathe([(0.006, 0.0), (0.006, 0.012), (0.014, 0.018), (0.014, 0.026), (0.004, 0.03)], 16)
        at = place(x + side * (pitch / 2 - 0.05), -depth / 2 - 0.003, 0.0, 0.12 + body * 0.62)
        at[:3, :3] = [[1, 0, 0], [0, 0, -1], [0, 1, 0]]
        knobs.append(transformed(ball, at))
    parts.append(solid(merged(knobs), knob, T_world))
    legs = [moved(frustum(0.014, 0.022, 0.12), x, y) for x, y in corners(width / 2 - 0.08, depth / 2 - 0.07)]
    return [*parts, solid(merged(legs), wood(rng, WOODS[3], along=2), T_world)]


def crate(
    rng: Rng, T_world: FloatArray = ORIGIN, size_m: Vector = (0.5, 0.35, 0.28), color: str | None = None
) -> list[Part]:
    """An open crate of rough slats."""
    timber = wood(rng, pick(rng, WOODS[2:6:3], color), gloss=0.03)
    width, depth, height = size_m
    slat = height / 3 - 0.012
    parts = [board((width - 0.02, depth - 0.02, 0.012), timber, T_world, (0.0, 0.0, 0.008))]
    for k in range(3):
        z = height / 6 + k * height / 3
        for s in (-1, 1):
            x, y = s * (width - 0.02) / 2, s * (depth - 0.012) / 2
            parts.append(board((width, 0.012, slat), timber, T_world, (0.0, y, z), edge_m=0.001))
            parts.append(board((0.012, depth - 0.026, slat), timber, T_world, (x, 0.0, z)))
    post = (0.03, 0.03, height - 0.01)
    inner = corners(width / 2 - 0.03, depth / 2 - 0.028)
    return parts + [board(post, timber, T_world, (x, y, height / 2)) for x, y in inner]


def cardboard_box(rng: Rng, T_world: FloatArray = ORIGIN, size_m: Vector = (0.4, 0.3, 0.3)) -> list[Part]:
    """A closed carton with a strip of packing tape."""
    return [board(size_m, cardboard(rng, max(size_m)), T_world, (0.0, 0.0, size_m[2] / 2))]


def bucket(rng: Rng, T_world: FloatArray = ORIGIN, color: str | None = None) -> list[Part]:
    """A ten-litre bucket with its wire handle down on one side."""
    tin = painted(rng, pick(rng, PAINTS, color), 0.2)
    outside, inside = [(0.0, 0.0), (0.1, 0.0), (0.14, 0.25)], [(0.134, 0.262), (0.096, 0.006), (0.0, 0.006)]
    wall = lathe([*outside, (0.145, 0.25), (0.145, 0.262), *inside], 32, 0.002)
    angle = np.linspace(0.0, np.pi, 15)
    bow = np.stack([0.15 * np.cos(angle), -0.147 * np.sin(angle) ** 0.6, 0.25 - 0.1 * np.sin(angle)], axis=1)
    return [solid(wall, tin, T_world), solid(tube(bow, 0.003, 8), steel(rng), T_world)]


def waste_bin(rng: Rng, T_world: FloatArray = ORIGIN, color: str | None = None) -> list[Part]:
    """A waste-paper bin with a few crumpled sheets."""
    shell = painted(rng, color, 0.2) if color else black_plastic()
    wall = [(0.0, 0.0), (0.11, 0.0), (0.14, 0.3), (0.135, 0.3), (0.105, 0.008), (0.0, 0.008)]
    half_circle = np.array([(np.sin(a), -np.cos(a)) for a in np.linspace(0.0, np.pi, 8)])
    paper = []
    for _ in range(4):
        ball, triangles = lathe(rng.uniform(0.045, 0.06) * half_circle, 11)
        ball = ball * rng.uniform(0.75, 1.1, (len(ball), 1))
        x, y = rng.uniform(-0.06, 0.06, 2)
        paper.append(moved((ball, triangles), x, y, rng.uniform(0.17, 0.24)))
    return [
        solid(lathe(wall, 32, 0.002), shell, T_world),
        solid(merged(paper), plain("#e9e6dd"), T_world, smooth=False),
    ]


def paint_can(rng: Rng, T_world: FloatArray = ORIGIN, color: str | None = None) -> list[Part]:
    """A tin of paint with a coloured label."""
    label = painted(rng, pick(rng, PAINTS, color), 0.15)
    tin = [(0.052, 0.0), (0.054, 0.004), (0.054, 0.126), (0.056, 0.13), (0.05, 0.132), (0.048, 0.127)]
    band = moved(cylinder(0.0548, 0.09), z_m=0.02)
    return [solid(lathe(tin, 32), steel(rng), T_world), solid(band, label, T_world)]
