"""Errors of guessed points by their confidence: how far the truth is from a guess, along its camera's ray."""

from __future__ import annotations

import numpy as np

from pipeline.types import FloatArray

CONFIDENCES = (0.5, 0.65, 0.8, 0.9, 1.0)
"""Edges of the classes of confidence."""
CHANCES = (0.005, 0.025, 0.05, 0.1, 0.25, 0.5, 0.75, 0.9, 0.95, 0.975, 0.995)
"""Chances of the quantiles."""
QUANTILES = (
    (-0.908, -0.434, -0.296, -0.147, -0.013, 0.017, 0.109, 0.222, 0.384, 0.489, 0.782),
    (-0.372, -0.210, -0.154, -0.126, -0.019, 0.004, 0.030, 0.103, 0.156, 0.258, 1.346),
    (-0.878, -0.159, -0.137, -0.069, -0.012, 0.003, 0.019, 0.057, 0.115, 0.140, 0.752),
    (-0.197, -0.073, -0.028, -0.009, -0.003, 0.000, 0.003, 0.011, 0.020, 0.029, 0.069),
)
"""Quantiles of log(true range / guessed range), a row per class, at marks on the surface of the fused cloud
of 40 rendered rooms (seeds 7,900,000 to 7,900,039). ``python -m lab.measuring guesses`` prints those of rooms
from 8,000,000 up (``lab.measuring.rooms.TUNING``)."""
UNKNOWN_RANGE_M = 5.0
"""Range of guessed points whose camera is unknown: that of the far side of a room, so that no interval is too
narrow."""


def class_of(confidence: float) -> int:
    """Return the class of a confidence, 0 to 1; an unknown one (NaN) is in the lowest class."""
    if not confidence >= CONFIDENCES[1]:
        return 0
    return int(np.searchsorted(CONFIDENCES[1:-1], confidence, side="right"))


def relative_errors(confidence: float, chances: FloatArray) -> FloatArray:
    """Return (M,) log(true range / guessed range) at (M,) chances, limited to those of ``CHANCES``."""
    return np.interp(chances, CHANCES, QUANTILES[class_of(confidence)])


def relative_half(confidence: float) -> float:
    """Return the larger side of the 95 % interval of a guessed range's relative error."""
    return float(np.abs(np.expm1(relative_errors(confidence, np.array([0.025, 0.975])))).max())
