"""Colours and their mixtures, the basis of all textures."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from lab.worlds.scene import Rng
from lab.worlds.textures.noise import fbm
from pipeline.types import FloatArray

Color = str | Sequence[float] | FloatArray
"""A "#rrggbb" colour as seen on a screen (sRGB), or linear RGB, 0 to 1."""


def linear(color: Color) -> FloatArray:
    """Return a colour as (3,) linear RGB."""
    if not isinstance(color, str):
        return np.asarray(color, float)
    c = np.array([int(color[i : i + 2], 16) for i in (1, 3, 5)]) / 255.0
    return np.where(c <= 0.04045, c / 12.92, ((c + 0.055) / 1.055) ** 2.4)


def random_palette(rng: Rng, count: int) -> FloatArray:
    """Return (count, 3) float32 linear colours of everyday objects: from muted to vivid, dark to light."""
    hue = rng.random(count)[:, None] + np.array([0.0, 1.0, 2.0]) / 3.0
    vivid = np.clip(np.abs((hue % 1.0) * 6.0 - 3.0) - 1.0, 0.0, 1.0)
    chroma = 0.75 * rng.random((count, 1)) ** 0.7
    value = rng.uniform(0.05, 0.95, (count, 1)) ** 1.4
    return (value * (1.0 - chroma + chroma * vivid)).astype(np.float32)


def as_color(color: Color) -> FloatArray:
    """Return (3,) float32 linear RGB."""
    return linear(color).astype(np.float32)


def mix(a: FloatArray, b: FloatArray, share: FloatArray) -> FloatArray:
    """Return the (N, 3) blend of two colours ((3,) or (N, 3)) by (N,) shares of the second, in 0 to 1."""
    return np.clip(a + (b - a) * np.asarray(share, np.float32)[:, None], 0.0, 1.0)


def shade(color: FloatArray, tone: FloatArray) -> FloatArray:
    """Return (N, 3) colours: a (3,) colour, or (N, 3) ones, times (N,) brightness, clipped to 0 to 1."""
    return np.clip(color * np.asarray(tone, np.float32)[:, None], 0.0, 1.0)


def soft_step(x: FloatArray, softness: float) -> FloatArray:
    """Return (N,) 0 below zero and 1 above, with a ramp of width ``softness`` about zero."""
    return np.clip(0.5 + x / softness, 0.0, 1.0)


def joint_share(a: FloatArray, b: FloatArray, a_m: float, b_m: float, joint_m: float) -> FloatArray:
    """Return (N,) share of joint at positions (a, b), 0 to 1, in a cell of ``a_m`` x ``b_m``.

    It is 1 at the cell's border, 0.5 at half a joint's width from it, and 0 farther inside.
    """
    distance_m = np.minimum((0.5 - np.abs(a - 0.5)) * a_m, (0.5 - np.abs(b - 0.5)) * b_m)
    return np.clip(1.5 - 2.0 * distance_m / joint_m, 0.0, 1.0)


def wood_grain(points_m: FloatArray, seed: int, scale_m: float, axis: int) -> FloatArray:
    """Return (N,) darkness of wood, 0 to 1: warped year rings and fibres along an axis."""
    stretch, fibre = np.full(3, scale_m), np.full(3, scale_m / 12.0)
    stretch[axis], fibre[axis] = 12.0 * scale_m, 4.0 * scale_m
    rings = (9.0 * fbm(points_m, stretch, seed, 2)) % 1.0
    fibres = fbm(points_m, fibre, seed + 1, 2)
    return np.clip(0.65 * rings * rings + 0.7 * (fibres - 0.35), 0.0, 1.0)
