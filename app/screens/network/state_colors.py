"""Colours of a delivery's cameras: how much of an image has arrived, and how much energy a node has used."""

from __future__ import annotations

import numpy as np

from app.drawing.colors import BRAND, DELIVERED, LOSS, SOURCE
from app.drawing.timeline import Color

BUSY, DOWN = BRAND, LOSS
FULL, EMPTY = DELIVERED, SOURCE


def state_color(down: bool, share: float) -> Color:
    """Return the colour of a camera of whose image this share has arrived."""
    if down:
        return DOWN
    return between(BUSY, DELIVERED, share)


def between(first: Color, second: Color, share: float) -> Color:
    """Return a colour between two others."""
    start, end = np.array(first, float), np.array(second, float)
    red, green, blue = np.rint(start + share * (end - start)).astype(int).tolist()
    return red, green, blue
