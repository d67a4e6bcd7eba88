"""Image pixels that the discs of a brush cover."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from app.screens.depth.view import Disc
from pipeline.types import BoolArray, FloatArray, IntArray

AROUND = 2.5
"""Side of the image part that is shown for a disc, in diameters of the disc."""


def disc_px(disc: Disc, width_px: int, height_px: int) -> tuple[float, float, float]:
    """Return column and row of the centre, and the radius, px."""
    x, y = disc.x_share * (width_px - 1), disc.y_share * (height_px - 1)
    return x, y, 0.5 * disc.size_share * width_px


def disc_at(u: float, v: float, width_px: int, height_px: int, size_share: float) -> Disc:
    """Return the disc around column ``u`` and row ``v``; ``size_share`` is its diameter over the width."""
    return Disc(u / max(width_px - 1, 1), v / max(height_px - 1, 1), size_share)


def covered(
    discs: Sequence[Disc], u: IntArray | FloatArray, v: IntArray | FloatArray, width_px: int, height_px: int
) -> BoolArray:
    """Return whether any disc covers each pixel, in the shape to which columns and rows broadcast."""
    inside = np.zeros(np.broadcast_shapes(np.shape(u), np.shape(v)), dtype=bool)
    for disc in discs:
        x, y, radius = disc_px(disc, width_px, height_px)
        inside |= (u - x) ** 2 + (v - y) ** 2 <= radius**2
    return inside


def window_around(discs: Sequence[Disc], width_px: int, height_px: int) -> tuple[slice, slice]:
    """Return the rows and columns that show all discs (at least one) and their surroundings."""
    places = np.array([disc_px(disc, width_px, height_px) for disc in discs])
    half = AROUND * places[:, 2:]
    left, top = np.maximum(0.0, (places[:, :2] - half).min(axis=0)).astype(int)
    right, bottom = ((places[:, :2] + half).max(axis=0)).astype(int) + 1
    return slice(top, min(height_px, bottom)), slice(left, min(width_px, right))
