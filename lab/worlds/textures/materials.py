"""Textures of furniture and objects."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from lab.worlds.scene import Texture
from lab.worlds.textures.mixing import Color, as_color, mix, shade, wood_grain
from lab.worlds.textures.noise import face_uv, fbm
from pipeline.types import FloatArray


def solid(color: Color) -> Texture:
    """One colour."""
    tint = as_color(color)
    return lambda points_m, normals: np.broadcast_to(tint, (len(points_m), 3))


def wood(light: Color, dark: Color, seed: int = 0, scale_m: float = 0.06, axis: int = 0) -> Texture:
    """Wood with year rings and fibres along one axis of the part."""
    early, late = as_color(light), as_color(dark)
    return lambda points_m, normals: mix(early, late, wood_grain(points_m, seed, scale_m, axis))


def brushed_metal(color: Color, seed: int = 0, axis: int = 0) -> Texture:
    """Metal with fine scratches along one axis; give the material gloss as well."""
    tint, scale_m = as_color(color), np.full(3, 0.003)
    scale_m[axis] = 0.25
    return lambda points_m, normals: shade(tint, 0.8 + 0.4 * fbm(points_m, scale_m, seed, 2))


def patches(colors: Sequence[Color], seed: int = 0, scale_m: float = 0.15) -> Texture:
    """Camouflage-like patches, for globes, clothes, bags, art and, at a small scale, terrazzo."""
    palette = np.array([as_color(c) for c in colors], np.float32)

    def texture(points_m: FloatArray, normals: FloatArray) -> FloatArray:
        level = (fbm(points_m, scale_m, seed, 4) - 0.25) / 0.5
        index = np.clip((level * len(palette)).astype(int), 0, len(palette) - 1)
        return shade(palette[index], 0.9 + 0.2 * fbm(points_m, scale_m / 6.0, seed + 1, 2))

    return texture


def cardboard(color: Color = (0.42, 0.27, 0.14), seed: int = 0, size_m: float = 0.4) -> Texture:
    """A corrugated box about the part's origin, with tape on top and bottom and printed marks."""
    color, tape, ink = as_color(color), np.array([0.5, 0.4, 0.24], np.float32), np.full(3, 0.05, np.float32)

    def texture(points_m: FloatArray, normals: FloatArray) -> FloatArray:
        u, v = face_uv(points_m, normals).T
        tone = 0.9 + 0.12 * np.sin(u * 1200.0) + 0.3 * (fbm(points_m, 0.2, seed, 4) - 0.5)
        base = mix(shade(color, tone), tape, (np.abs(normals[:, 2]) > 0.5) * (np.abs(v) < 0.025) * 0.8)
        mark = (np.abs(u / size_m - 0.25) < 0.1) & (np.abs(v / size_m + 0.2) < 0.06)
        return mix(base, ink, mark * (np.sin(v * 400.0) > 0.0) * 0.8)

    return texture


def leaf(color: Color, seed: int = 0) -> Texture:
    """Foliage: veins and light and dark greens."""
    color = as_color(color)
    young = np.clip(color * [2.2, 1.6, 1.2], 0.0, 1.0)

    def texture(points_m: FloatArray, normals: FloatArray) -> FloatArray:
        veins = 0.5 + 0.5 * np.sin(fbm(points_m, 0.06, seed, 3) * 40.0)
        return mix(color, young, 0.25 * veins + 0.75 * fbm(points_m, 0.1, seed + 1, 3))

    return texture
