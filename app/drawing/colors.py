"""The app's fixed colours, which colour-blind people can distinguish too (after Okabe and Ito)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pipeline.types import ByteArray, FloatArray

SOURCE = (230, 159, 0)
"""Orange: the source cloud, which moves."""
TARGET = (0, 114, 178)
"""Blue: the target cloud, which stays, and the sensor's points."""
INFERRED = (148, 80, 200)
"""Violet: depth inferred by the network."""
LOSS = (213, 40, 30)
"""Red: holes, outliers and losses."""
DELIVERED = (0, 158, 115)
"""Green: delivered or correct."""
HOLE = (255, 0, 255)
"""Magenta: pixels without depth in a picture."""
GHOST = (214, 51, 132)
"""Pink: planned cameras, and what they would newly see."""
GHOST_DARK = (112, 72, 40)
"""Brown: of that, surface that looks dark to a present sensor, and may stay without depth."""
NEUTRAL = (120, 130, 140)
"""Grey: frames and context."""
DISTANCE_STOPS = ((68, 1, 84), (59, 82, 139), (33, 145, 140), (94, 201, 98), (253, 231, 37))
"""Colours of distances from zero to ``MOST_DISTANCE_M`` and beyond (viridis, dark to light)."""
MOST_DISTANCE_M = 0.1
CONFIDENCE_STOPS = DISTANCE_STOPS
"""Colours of confidence from 0 to 100 %: higher is brighter."""
COVERAGE_STOPS = ((94, 23, 110), (70, 90, 150), (40, 150, 150), DELIVERED)
"""Colours of a road's coverage from 0 to 100 %: violet to green."""
BRAND = (0, 90, 140)
"""The theme's colour."""


def css(color: tuple[int, int, int]) -> str:
    """Return the colour as ``#rrggbb``."""
    return "#{:02x}{:02x}{:02x}".format(*color)


BACKGROUND = (214, 219, 224)
"""Background of the scene, against which white walls and dark furniture are visible."""


def ramp(values: FloatArray, most: float, stops: Sequence[tuple[int, int, int]]) -> ByteArray:
    """Return RGB (last axis 3) of values from 0 to ``most`` and beyond, between equally spaced colours."""
    at = np.linspace(0.0, most, len(stops))
    channels = [np.interp(values, at, channel) for channel in zip(*stops, strict=True)]
    return np.rint(np.stack(channels, axis=-1)).astype(np.uint8)


def linear(colors: ByteArray) -> ByteArray:
    """Return RGB (last axis 3) in linear light instead of sRGB, as viser takes the end colours of lines."""
    share = colors / 255.0
    light = np.where(share <= 0.04045, share / 12.92, ((share + 0.055) / 1.055) ** 2.4)
    return np.rint(255.0 * light).astype(np.uint8)
