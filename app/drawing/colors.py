"""The app's fixed colours, told apart by colour-blind people too (after Okabe and Ito)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pipeline.types import ByteArray, FloatArray

SOURCE = (230, 159, 0)
"""Orange: the cloud that moves."""
TARGET = (0, 114, 178)
"""Blue: the cloud that stays, and the sensor's points."""
INFERRED = (148, 80, 200)
"""Violet: what the network inferred."""
LOSS = (213, 40, 30)
"""Red: holes, outliers and losses."""
DELIVERED = (0, 158, 115)
"""Green: what is there and right."""
HOLE = (255, 0, 255)
"""Magenta: pixels without depth in a picture."""
NEUTRAL = (120, 130, 140)
"""Grey: frames and what is only context."""
DISTANCE_STOPS = ((68, 1, 84), (59, 82, 139), (33, 145, 140), (94, 201, 98), (253, 231, 37))
"""Distances from zero to ``MOST_DISTANCE_M`` and beyond (viridis, dark to light)."""
MOST_DISTANCE_M = 0.1
CONFIDENCE_STOPS = DISTANCE_STOPS
"""Confidence from 0 to 100 %: the surer, the brighter."""
COVERAGE_STOPS = ((94, 23, 110), (70, 90, 150), (40, 150, 150), DELIVERED)
"""Coverage of a road from 0 to 100 %: from violet to green."""
BRAND = (0, 90, 140)
"""The theme's colour."""


def css(color: tuple[int, int, int]) -> str:
    """The colour as ``#rrggbb``."""
    return "#{:02x}{:02x}{:02x}".format(*color)


BACKGROUND = (214, 219, 224)
"""Behind the scene: white walls and dark furniture both stand out."""


def ramp(values: FloatArray, most: float, stops: Sequence[tuple[int, int, int]]) -> ByteArray:
    """RGB, with a last axis of 3, of values from 0 to ``most`` and beyond, between evenly placed colours."""
    at = np.linspace(0.0, most, len(stops))
    channels = [np.interp(values, at, channel) for channel in zip(*stops, strict=True)]
    return np.rint(np.stack(channels, axis=-1)).astype(np.uint8)


def linear(colors: ByteArray) -> ByteArray:
    """RGB as viser takes it for the ends of lines of several colours: in linear light, not sRGB."""
    share = colors / 255.0
    light = np.where(share <= 0.04045, share / 12.92, ((share + 0.055) / 1.055) ** 2.4)
    return np.rint(255.0 * light).astype(np.uint8)
