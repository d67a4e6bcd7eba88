"""Materials of furniture and objects, with plausible colour, gloss and infrared response."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from lab.worlds import textures
from lab.worlds.primitives import Vector
from lab.worlds.room_finishes import draw_seed
from lab.worlds.scene import Material, Rng
from lab.worlds.textures.mixing import Color, linear
from pipeline.types import FloatArray

FABRICS = ("#8a9a8e", "#b7a58c", "#5d6d7e", "#a4533c", "#d8cfc0", "#3f4f4a", "#7b6c8d", "#c29a5b", "#8c8c88")
WOODS = ("#b98a58", "#8a5a33", "#d2b083", "#5b3a24", "#a8754a", "#c9a06c")
PAINTS = ("#f2efe8", "#dfe5e3", "#33393d", "#9fb3b0", "#b8c4a9", "#c7653f", "#2f5d73", "#e3c15a")
BOOKS = (
    "#7d2b2b",
    "#23405c",
    "#d9c9a3",
    "#2e4d3a",
    "#c98b3a",
    "#4b3b52",
    "#e4e0d6",
    "#1f1f22",
    "#a8482e",
    "#5f7f8c",
)


def pick(rng: Rng, palette: Sequence[str], color: str | None = None) -> FloatArray:
    """Return (3,) linear RGB: ``color``, or if it is None a random one of the palette, slightly varied."""
    if color is not None:
        return linear(color)
    return np.clip(linear(palette[int(rng.integers(len(palette)))]) * rng.uniform(0.85, 1.15, 3), 0.0, 0.95)


def plain(color: Color, gloss: float = 0.0, infrared: float = 1.0) -> Material:
    """One colour all over."""
    return Material(textures.solid(color), gloss, infrared)


def fabric(rng: Rng, color: Color, second: Color | None = None) -> Material:
    """Woven cloth, plain or of two colours."""
    return Material(textures.fabric(color, second, draw_seed(rng), rng.uniform(0.004, 0.008)))


def wood(rng: Rng, color: Color, along: int = 0, gloss: float = 0.05) -> Material:
    """Oiled wood, its grain along an axis of the part."""
    light = linear(color)
    grain = textures.wood(light * 1.08, light * [0.62, 0.56, 0.5], draw_seed(rng), 0.05, along)
    return Material(grain, gloss)


def painted(rng: Rng, color: Color, gloss: float = 0.08) -> Material:
    """Paint or lacquer with slight unevenness."""
    return Material(textures.paint(color, draw_seed(rng)), gloss)


def ceramic(color: Color) -> Material:
    """Glazed china."""
    return plain(color, 0.3)


def black_plastic(gloss: float = 0.2) -> Material:
    """The black plastic of screens and keyboards, which absorbs infrared."""
    return plain((0.014, 0.014, 0.015), gloss, infrared=0.25)


def chrome() -> Material:
    """Polished metal: a mirror, of which the sensor measures no depth."""
    return plain((0.55, 0.56, 0.58), 0.95, infrared=0.3)


def steel(rng: Rng, color: Color = "#8b8f93", axis: int = 0) -> Material:
    """Brushed or rolled metal."""
    return Material(textures.brushed_metal(color, draw_seed(rng), axis), 0.4, infrared=0.8)


def leaf(rng: Rng, color: Color) -> Material:
    """A plant's leaf, bright in the infrared."""
    return Material(textures.leaf(color, draw_seed(rng)), 0.12, infrared=1.6)


def cardboard(rng: Rng, size_m: float) -> Material:
    """Corrugated board with tape, on a box about its part's origin with a longest side of ``size_m``."""
    return Material(textures.cardboard("#b08a5b", draw_seed(rng), size_m))


def book(rng: Rng, color: Color) -> Material:
    """Cloth-bound books that stand on z = 0 with lettering on their spines, towards -y, and pages on top."""
    cover, title, pages = linear(color), linear("#d8c48e"), linear("#e8e0cc")
    bands = rng.uniform(0.03, 0.2, (3, 1)) + np.array([0.0, 0.004])
    bands[1, 1] += rng.uniform(0.015, 0.04)

    def texture(points_m: FloatArray, normals: FloatArray) -> FloatArray:
        height = points_m[:, 2:]
        lettered = ((height > bands[:, 0]) & (height < bands[:, 1])).any(axis=1) & (normals[:, 1] < -0.7)
        albedo = np.where(lettered[:, None], title, cover)
        return np.where(normals[:, 2:] > 0.7, pages, albedo)

    return Material(texture, 0.08)


def enamel(color: Color) -> Material:
    """A lamp's dome or a dish turned about z: coloured outside, white inside."""
    outer, inner = linear(color), linear("#f3f0e8")

    def texture(points_m: FloatArray, normals: FloatArray) -> FloatArray:
        outwards = np.einsum("nk,nk->n", points_m[:, :2], normals[:, :2]) > 0.0
        return np.where(outwards[:, None], outer, inner)

    return Material(texture, 0.25)


def glow(color: Color, strength: float) -> Material:
    """A lit lamp shade or bulb."""
    return Material(textures.solid(color), emission=strength)


def screen(rng: Rng, size_m: Vector, lit: bool) -> Material:
    """A glossy display: black when off."""
    if not lit:
        return plain((0.012, 0.013, 0.016), 0.85, infrared=0.1)
    return Material(textures.display(draw_seed(rng), size_m), 0.5, infrared=0.1, emission=0.9)
