"""Random materials of floors, walls and objects, varied enough that a network cannot memorise a style."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from lab.worlds import textures
from lab.worlds.scene import Material, Part, Rng
from pipeline.types import FloatArray


def random_floor(rng: Rng) -> Material:
    """Boards, parquet, tiles, carpet, concrete or stone."""
    light, dark = random_timber(rng)
    color, second = muted(rng, 2, 0.05, 0.5)
    seed = draw_seed(rng)
    kind = rng.choice(7, p=[0.22, 0.15, 0.17, 0.24, 0.1, 0.06, 0.06])
    if kind == 0:
        width_m, length_m = rng.uniform(0.06, 0.22), rng.uniform(0.6, 2.0)
        return Material(textures.planks(light, dark, seed, width_m, length_m), rng.uniform(0.0, 0.35))
    if kind == 1:
        strips, strip_m = int(rng.integers(3, 8)), rng.uniform(0.04, 0.09)
        return Material(textures.parquet(light, dark, seed, strip_m, strips), rng.uniform(0.0, 0.35))
    if kind == 2:
        tiles = textures.tiles(color, second, seed, rng.uniform(0.15, 0.6), rng.uniform(0.02, 0.25))
        return Material(tiles, rng.uniform(0.0, 0.4))
    if kind == 3:
        return Material(textures.carpet(color, seed, rng.uniform(0.006, 0.03), rng.uniform(0.1, 0.4)))
    if kind == 4:
        return Material(textures.concrete(color, seed), rng.uniform(0.0, 0.2))
    if kind == 5:
        return Material(textures.checker(color, second, rng.uniform(0.2, 0.5), seed), rng.uniform(0.0, 0.3))
    return Material(textures.marble(color, second, seed, rng.uniform(0.2, 0.8)), rng.uniform(0.1, 0.45))


def random_wall(rng: Rng) -> Material:
    """Mostly light paint or plaster; some wallpaper, panelling, brick and tiles."""
    color = muted(rng, 1, 0.3, 0.85, 0.12)[0] if rng.random() < 0.75 else muted(rng, 1, 0.05, 0.5)[0]
    second = np.clip(color * rng.uniform(0.5, 1.5, 3), 0.02, 0.9)
    light, dark = random_timber(rng)
    seed = draw_seed(rng)
    kind = rng.choice(7, p=[0.32, 0.28, 0.09, 0.09, 0.08, 0.07, 0.07])
    if kind == 0:
        paint = textures.paint(color, seed, rng.uniform(0.02, 0.15), rng.uniform(0.2, 1.2))
        return Material(paint, rng.uniform(0.0, 0.08))
    if kind == 1:
        return Material(textures.plaster(color, seed, rng.uniform(0.008, 0.05), rng.uniform(0.02, 0.15)))
    if kind == 2:
        return Material(textures.stripes(color, second, seed, rng.uniform(0.03, 0.2)))
    if kind == 3:
        return Material(textures.motif(color, second, seed, rng.uniform(0.06, 0.35)))
    if kind == 4:
        brick = color if rng.random() < 0.4 else np.array([0.36, 0.15, 0.09]) * rng.uniform(0.6, 1.4)
        return Material(textures.brick(brick, muted(rng, 1, 0.3, 0.7)[0], seed))
    if kind == 5:
        tiles = textures.tiles(color, second, seed, rng.uniform(0.08, 0.4), 0.08)
        return Material(tiles, rng.uniform(0.1, 0.3))
    return Material(textures.planks(light, dark, seed, rng.uniform(0.08, 0.3), 3.0), 0.1)


def random_material(rng: Rng) -> Material:
    """A random material of an object."""
    color, second, third = textures.random_palette(rng, 3)
    light, dark = random_timber(rng)
    seed, gloss = draw_seed(rng), float(rng.choice([0.0, 0.0, 0.1, 0.3, 0.5]))
    makers = (
        lambda: textures.paint(color, seed),
        lambda: textures.paint(color, seed, 0.15, 0.1),
        lambda: textures.wood(light, dark, seed, rng.uniform(0.03, 0.12), int(rng.integers(3))),
        lambda: textures.fabric(color, second, seed, rng.uniform(0.004, 0.02)),
        lambda: textures.stripes(color, second, seed, rng.uniform(0.01, 0.08), bool(rng.integers(2))),
        lambda: textures.motif(color, second, seed, rng.uniform(0.03, 0.2)),
        lambda: textures.checker(color, second, rng.uniform(0.02, 0.12), seed),
        lambda: textures.patches([color, second, third], seed, rng.uniform(0.04, 0.3)),
        lambda: textures.painting(seed, rng.uniform(0.2, 0.6)),
        lambda: textures.cardboard(seed=seed, size_m=rng.uniform(0.2, 0.6)),
        lambda: textures.marble(color, second, seed, rng.uniform(0.1, 0.5)),
        lambda: textures.brushed_metal(muted(rng, 1, 0.3, 0.7)[0], seed, int(rng.integers(3))),
        lambda: textures.paper(seed, rng.uniform(0.006, 0.02)),
        lambda: textures.plaster(color, seed, rng.uniform(0.004, 0.03), rng.uniform(0.1, 0.4)),
    )
    return Material(makers[rng.integers(len(makers))](), gloss, infrared=float(rng.uniform(0.5, 1.5)))


def recolored(parts: list[Part], rng: Rng) -> list[Part]:
    """Return a piece with its albedo times a random tint, which keeps textures; lamps stay unchanged."""
    gain = np.clip(rng.uniform(0.45, 1.7) * rng.uniform(0.6, 1.4, 3), 0.2, 2.0).astype(np.float32)
    return [
        part if part.material.emission > 0.0 else replace(part, material=_tinted(part.material, gain))
        for part in parts
    ]


def random_timber(rng: Rng) -> tuple[FloatArray, FloatArray]:
    """Return light and dark (3,) colour of a wood, from maple over oak and cherry to wenge, or limed grey."""
    light = np.array([0.55, 0.36, 0.19]) * rng.uniform([0.9, 0.75, 0.6], [1.1, 1.15, 1.5])
    light *= rng.uniform(0.15, 1.3)
    light = light + rng.uniform(0.0, 0.5) ** 2 * (light.mean() - light)
    return np.clip(light, 0.02, 0.85), np.clip(light * rng.uniform(0.35, 0.75), 0.01, 0.6)


def muted(rng: Rng, count: int, low: float, high: float, chroma: float = 0.4) -> FloatArray:
    """Return (count, 3) colours of low to medium saturation with a luminance from about low to high."""
    value = rng.uniform(low, high, (count, 1))
    tint = rng.uniform(0.0, chroma, (count, 1)) * rng.uniform(-1.0, 1.0, (count, 3))
    return np.clip(value * (1.0 + tint), 0.01, 0.9)


def draw_seed(rng: Rng) -> int:
    """Return a random seed for a texture."""
    return int(rng.integers(2**31))


def _tinted(material: Material, gain: FloatArray) -> Material:
    own = material.texture
    return replace(material, texture=lambda places, normals: np.clip(own(places, normals) * gain, 0.0, 0.95))


def covered(parts: list[Part], material: Material) -> list[Part]:
    """Return the parts in one material, except those that emit light."""
    return [part if part.material.emission > 0.0 else replace(part, material=material) for part in parts]


def lamp_white(rng: Rng) -> FloatArray:
    """Return (3,) white of a colour temperature from about 2700 to 8000 K."""
    return np.array([1.0, 0.78, 0.52]) + rng.random() ** 0.7 * np.array([-0.12, 0.14, 0.55])
