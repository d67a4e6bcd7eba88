"""Rounding of positions to 32-bit numbers, which is coarse far from the origin."""

from __future__ import annotations

import numpy as np

from pipeline.types import FloatArray

MOST_ROUNDING_M = 1e-4
"""Files store positions as 32-bit numbers only if this moves no point farther."""


def too_coarse(points_m: FloatArray) -> bool:
    """Return whether rounding (N, 3) points to 32 bits moves one by more than ``MOST_ROUNDING_M``."""
    points_m = np.asarray(points_m, dtype=np.float64)
    with np.errstate(invalid="ignore", over="ignore"):
        moved_m = np.linalg.norm(points_m.astype(np.float32) - points_m, axis=1)
    return bool(np.any(moved_m > MOST_ROUNDING_M))  # False for points that are not finite


def middle_m(points_m: FloatArray) -> FloatArray:
    """Return (3,) the middle of the points' box, rounded to whole metres."""
    finite_m = points_m[np.isfinite(points_m).all(axis=1)]
    return np.rint(0.5 * (finite_m.min(axis=0) + finite_m.max(axis=0)))
