"""Textures of carpets, cloth and wallpaper."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from lab.worlds.primitives import Vector
from lab.worlds.scene import Texture
from lab.worlds.textures.mixing import Color, as_color, mix, shade, soft_step
from lab.worlds.textures.noise import cell_random, face_uv, fbm
from pipeline.types import FloatArray


def carpet(color: Color, seed: int = 0, pile_m: float = 0.008, mottling: float = 0.3) -> Texture:
    """Carpet pile: fine grain over soft tracks."""
    color = as_color(color)

    def texture(points_m: FloatArray, normals: FloatArray) -> FloatArray:
        pile = fbm(points_m, pile_m, seed, 2) - 0.5
        tracks = fbm(points_m, 0.4, seed + 1, 3) - 0.5
        return shade(color, 1.0 + 2.2 * mottling * pile + mottling * tracks)

    return texture


def fabric(color: Color, second: Color | None = None, seed: int = 0, thread_m: float = 0.006) -> Texture:
    """Woven cloth: crossing threads of one or two colours, with soft variation from folds."""
    color = as_color(color)
    second = color * 0.72 if second is None else as_color(second)

    def texture(points_m: FloatArray, normals: FloatArray) -> FloatArray:
        u, v = (face_uv(points_m, normals) * np.float32(np.pi / thread_m)).T
        weave = 0.5 + 0.5 * np.sin(u) * np.sin(v)
        soft = 0.86 + 0.28 * fbm(points_m, 0.12, seed, 3)
        return shade(mix(color, second, weave), soft)

    return texture


def stripes(
    color: Color, second: Color, seed: int = 0, width_m: float = 0.08, vertical: bool = True
) -> Texture:
    """Wallpaper or cloth with stripes of uneven widths, ``width_m`` on average."""
    color, second = as_color(color), as_color(second)

    def texture(points_m: FloatArray, normals: FloatArray) -> FloatArray:
        x = face_uv(points_m, normals)[:, 0 if vertical else 1] / (2.0 * width_m)
        cell = np.floor(x)
        edge = 0.35 + 0.3 * cell_random(np.zeros_like(cell), cell % 4.0, seed)
        bar = soft_step(edge - np.abs(2.0 * (x - cell) - 1.0), 0.04)
        return shade(mix(color, second, bar), 0.93 + 0.14 * fbm(points_m, 0.5, seed, 3))

    return texture


def motif(color: Color, second: Color, seed: int = 0, size_m: float = 0.14) -> Texture:
    """Printed wallpaper or cloth: a flower-like motif on a staggered lattice."""
    color, second = as_color(color), as_color(second)
    rng = np.random.default_rng(seed)
    petals, radius, depth = int(rng.integers(3, 9)), rng.uniform(0.2, 0.36), rng.uniform(0.0, 0.5)

    def texture(points_m: FloatArray, normals: FloatArray) -> FloatArray:
        u, v = (face_uv(points_m, normals) / size_m).T
        row = np.floor(v)
        x, y = (u + 0.5 * (row % 2.0)) % 1.0 - 0.5, v - row - 0.5
        reach = radius * (1.0 + depth * np.cos(petals * np.arctan2(y, x)))
        shape = soft_step(reach - np.hypot(x, y), 0.05)
        return shade(mix(color, second, shape), 0.92 + 0.16 * fbm(points_m, 0.6, seed, 3))

    return texture


def checker(color: Color, second: Color, size_m: float = 0.1, seed: int = 0) -> Texture:
    """Squares of two colours."""
    color, second = as_color(color), as_color(second)

    def texture(points_m: FloatArray, normals: FloatArray) -> FloatArray:
        i, j = np.floor(face_uv(points_m, normals) / size_m).T
        tone = 0.9 + 0.2 * fbm(points_m, 0.05, seed, 3)
        return shade(mix(color, second, (i + j) % 2.0), tone)

    return texture


def rug(colors: Sequence[Color], seed: int = 0, size_m: Vector = (2.0, 1.4)) -> Texture:
    """A woven rug about the part's origin: frames around a field of diamonds.

    Args:
        colors: colours that alternate in the diamonds and the frames (three or more).
        seed: chooses the pattern.
        size_m: (x, y) size of the rug.
    """
    palette = np.array([as_color(c) for c in colors])
    rng = np.random.default_rng(seed)
    pitch_m, rings = rng.uniform(0.12, 0.35), rng.integers(2, 5)

    def texture(points_m: FloatArray, normals: FloatArray) -> FloatArray:
        u, v = face_uv(points_m, normals).T
        inside = np.minimum(size_m[0] / 2.0 - np.abs(u), size_m[1] / 2.0 - np.abs(v))
        diamond = np.abs((u / pitch_m) % 2.0 - 1.0) + np.abs((v / pitch_m) % 2.0 - 1.0)
        index = np.floor(diamond * rings).astype(int) % len(palette)
        frame = np.floor(inside / 0.045).astype(int)
        index = np.where((frame >= 0) & (frame < 4), (frame * 2 + 1) % len(palette), index)
        return shade(palette[index].astype(np.float32), 0.65 + 0.7 * fbm(points_m, 0.01, seed, 2))

    return texture
