"""Textures of pictures: paintings, pages, screens, the view from a window."""

from __future__ import annotations

import numpy as np

from lab.worlds.primitives import Vector
from lab.worlds.scene import Texture
from lab.worlds.textures.mixing import mix, random_palette, shade, soft_step
from lab.worlds.textures.noise import cell_random, face_uv, fbm
from pipeline.types import FloatArray


def painting(seed: int = 0, scale_m: float = 0.4) -> Texture:
    """A poster or painting: overlapping blobs, bars and washes in a palette of its own."""
    rng = np.random.default_rng(seed)
    palette = random_palette(rng, 6)
    shapes = []
    for _ in range(rng.integers(4, 11)):
        center, radius = rng.uniform(-0.6, 0.6, 2) * scale_m, rng.uniform(0.08, 0.5, 2) * scale_m
        shapes.append((center, radius, rng.uniform(0, np.pi), rng.integers(2)))

    def texture(points_m: FloatArray, normals: FloatArray) -> FloatArray:
        uv = face_uv(points_m, normals)
        wash = fbm(points_m, scale_m, seed, 4)
        color = mix(palette[0], palette[1], np.clip(2.0 * wash - 0.5, 0.0, 1.0))
        for k, (center, radius, angle, round_) in enumerate(shapes):
            c, s = np.cos(angle), np.sin(angle)
            x, y = ((uv - center) @ np.array([[c, -s], [s, c]]) / radius).T
            reach = np.hypot(x, y) if round_ else np.maximum(np.abs(x), np.abs(y))
            inside = soft_step(1.0 + 0.5 * (wash - 0.5) - reach, 0.03)
            color += (palette[2 + k % 4] - color) * inside[:, None]
        return shade(color, 0.9 + 0.2 * fbm(points_m, 0.02, seed, 2))

    return texture


def paper(seed: int = 0, line_m: float = 0.008) -> Texture:
    """A printed page: lines of text on white."""

    def texture(points_m: FloatArray, normals: FloatArray) -> FloatArray:
        u, v = face_uv(points_m, normals).T
        line = np.floor(v / line_m)
        word = np.floor(u / 0.012 + 5.0 * cell_random(line, line, seed))
        ink = (cell_random(word, line, seed) > 0.25) & (v / line_m - line < 0.5) & (line % 7.0 > 0.5)
        tone = np.where(ink[:, None], np.float32(0.3), np.float32(0.78))
        return tone * np.array([1.0, 0.99, 0.95], np.float32)

    return texture


def display(seed: int, size_m: Vector) -> Texture:
    """A computer screen: a desktop with windows full of lines, about the part's origin."""
    rng = np.random.default_rng(seed)
    palette = random_palette(rng, 4)
    windows = [(rng.uniform(-0.3, 0.3, 2), rng.uniform(0.1, 0.3, 2), rng.random() < 0.7) for _ in range(3)]

    def texture(points_m: FloatArray, normals: FloatArray) -> FloatArray:
        u, v = (face_uv(points_m, normals) / np.asarray(size_m, np.float32)).T
        color = mix(palette[0], palette[1], fbm(points_m, 0.4, seed, 3))
        for k, (center, half, light) in enumerate(windows):
            x, y = u - center[0], v - center[1]
            line = np.floor(y * 40.0)
            end = half[0] * (0.9 * cell_random(line, line, seed + k) * 2.0 - 1.0)
            text = (y * 40.0 - line < 0.5) & (x < end)
            page = np.where(text[:, None], 0.25 if light else 0.6, 0.85 if light else 0.03)
            page = np.where((y > half[1] - 0.03)[:, None], palette[2 + k % 2], page)
            inside = (np.abs(x) < half[0]) & (np.abs(y) < half[1])
            color = np.where(inside[:, None], page, color)
        return np.clip(color, 0.0, 1.0).astype(np.float32)

    return texture


def outdoors(seed: int) -> Texture:
    """A view through a window: a bright sky, clouds, far trees or houses below about z = -0.2."""
    rng = np.random.default_rng(seed)
    sky, haze = np.array([0.45, 0.68, 0.98]), np.array([0.93, 0.95, 0.97])
    ground = np.array([[0.12, 0.22, 0.08], [0.32, 0.29, 0.26]][int(rng.integers(2))])

    def texture(points_m: FloatArray, normals: FloatArray) -> FloatArray:
        v = face_uv(points_m, normals)[:, 1]
        color = mix(sky, haze, np.clip(2.2 * fbm(points_m, 0.8, seed, 4) - 0.7, 0.0, 1.0))
        skyline = -0.2 + 0.5 * (fbm(points_m * [1.0, 1.0, 0.0], 0.35, seed + 1, 3) - 0.5)
        trees = shade(ground, 0.4 + 1.2 * fbm(points_m, 0.1, seed + 2, 3))
        return mix(color, trees, soft_step(skyline - v, 0.01))

    return texture
