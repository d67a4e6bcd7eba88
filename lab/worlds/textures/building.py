"""Textures of floors, walls and other building parts."""

from __future__ import annotations

import numpy as np

from lab.worlds.scene import Texture
from lab.worlds.textures.mixing import Color, as_color, joint_share, mix, shade, wood_grain
from lab.worlds.textures.noise import cell_random, face_uv, fbm
from pipeline.types import FloatArray


def paint(color: Color, seed: int = 0, mottling: float = 0.06, scale_m: float = 0.35) -> Texture:
    """Paint, plastic, lacquer: one colour with slight unevenness."""
    tint, reach = as_color(color), 2.0 * mottling
    return lambda points_m, normals: shade(tint, 1.0 + reach * (fbm(points_m, scale_m, seed, 3) - 0.5))


def plaster(color: Color, seed: int = 0, grain_m: float = 0.012, roughness: float = 0.12) -> Texture:
    """A painted or rough-cast wall: large stains and small grain."""
    color = as_color(color)

    def texture(points_m: FloatArray, normals: FloatArray) -> FloatArray:
        stains = fbm(points_m, 0.9, seed, 3) - 0.5
        grain = fbm(points_m, grain_m, seed + 1, 2) - 0.5
        return shade(color, 1.0 + 0.16 * stains + 2.0 * roughness * grain)

    return texture


def concrete(color: Color, seed: int = 0) -> Texture:
    """Cast concrete with clouds, pores and grain."""
    color = as_color(color)

    def texture(points_m: FloatArray, normals: FloatArray) -> FloatArray:
        clouds = fbm(points_m, 0.5, seed, 4, 0.6)
        pores = np.clip(fbm(points_m, 0.012, seed + 1, 2) * 6.0 - 4.3, 0.0, 1.0)
        return shade(color, 0.72 + 0.56 * clouds - 0.35 * pores)

    return texture


def planks(light: Color, dark: Color, seed: int = 0, width_m: float = 0.12, length_m: float = 1.4) -> Texture:
    """Floor boards: rows of planks with their own tone and grain, and dark joints."""
    light, dark = as_color(light), as_color(dark)

    def texture(points_m: FloatArray, normals: FloatArray) -> FloatArray:
        uv = face_uv(points_m, normals)
        row = np.floor(uv[:, 1] / width_m)
        along = uv[:, 0] / length_m + cell_random(row, row, seed)
        board = np.floor(along)
        joint = joint_share(along - board, uv[:, 1] / width_m - row, length_m, width_m, 0.002)
        return _boards(light, dark, seed, uv, cell_random(board, row, seed), joint)

    return texture


def parquet(light: Color, dark: Color, seed: int = 0, strip_m: float = 0.07, strips: int = 5) -> Texture:
    """Basket-weave parquet: squares of strips, turned alternately."""
    light, dark = as_color(light), as_color(dark)
    side_m = strip_m * strips

    def texture(points_m: FloatArray, normals: FloatArray) -> FloatArray:
        uv = face_uv(points_m, normals)
        i, j = np.floor(uv / side_m).T
        uv = np.where(((i + j) % 2.0 == 1.0)[:, None], uv[:, ::-1], uv)
        row = np.floor(uv[:, 1] / strip_m)
        joint = joint_share(uv[:, 0] / side_m % 1.0, uv[:, 1] / strip_m - row, side_m, strip_m, 0.002)
        return _boards(light, dark, seed, uv, cell_random(i * 31.0 + j, row, seed), joint)

    return texture


def tiles(
    color: Color,
    grout: Color = (0.35, 0.34, 0.32),
    seed: int = 0,
    size_m: float = 0.3,
    variation: float = 0.12,
) -> Texture:
    """Square tiles with joints."""
    color, grout = as_color(color), as_color(grout)

    def texture(points_m: FloatArray, normals: FloatArray) -> FloatArray:
        u, v = (face_uv(points_m, normals) / size_m).T
        i, j = np.floor(u), np.floor(v)
        tone = 1.0 + variation * (2.0 * cell_random(i, j, seed) - 1.0)
        tone += 0.25 * (fbm(points_m, 0.15 * size_m / 0.3, seed, 3) - 0.5)
        return mix(shade(color, tone), grout, joint_share(u - i, v - j, size_m, size_m, 0.004))

    return texture


def brick(color: Color, mortar: Color, seed: int = 0) -> Texture:
    """Running-bond brickwork."""
    color, mortar = as_color(color), as_color(mortar)
    length_m, height_m = 0.24, 0.075

    def texture(points_m: FloatArray, normals: FloatArray) -> FloatArray:
        u, v = face_uv(points_m, normals).T
        row = np.floor(v / height_m)
        along = u / length_m + 0.5 * (row % 2.0)
        cell = np.floor(along)
        tone = 0.65 + 0.6 * cell_random(cell, row, seed) + 0.8 * (fbm(points_m, 0.03, seed, 3) - 0.5)
        joint = joint_share(along - cell, v / height_m - row, length_m, height_m, 0.01)
        return mix(shade(color, tone), shade(mortar, 0.8 + 0.4 * fbm(points_m, 0.01, seed, 2)), joint)

    return texture


def marble(color: Color, vein: Color, seed: int = 0, scale_m: float = 0.35) -> Texture:
    """Stone with warped veins."""
    color, vein = as_color(color), as_color(vein)

    def texture(points_m: FloatArray, normals: FloatArray) -> FloatArray:
        warp = fbm(points_m, scale_m, seed, 5, 0.6)
        lines = 1.0 - np.abs(np.sin(14.0 * warp + 3.0 * fbm(points_m, 2.0 * scale_m, seed + 1, 2)))
        return mix(color, vein, np.clip(lines, 0.0, 1.0) ** 6 * 0.8 + 0.2 * (1.0 - warp))

    return texture


def _boards(
    light: FloatArray, dark: FloatArray, seed: int, uv: FloatArray, tone: FloatArray, joint: FloatArray
) -> FloatArray:
    """Return (N, 3) albedo at (N, 2) places, the grain along u, for each board's (N,) tone, 0 to 1."""
    grain = wood_grain(np.column_stack([uv[:, 0], uv[:, 1] + 3.0 * tone, tone]), seed, 0.05, 0)
    color = shade(mix(light, dark, grain), 0.72 + 0.5 * tone)
    return color * (1.0 - 0.75 * joint)[:, None]
