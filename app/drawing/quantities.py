"""Lengths, angles and areas with their 95 % intervals, and places of cameras, as text."""

from __future__ import annotations

import math
from collections.abc import Sequence

from app.compute.measures import Quantity

STANDS_ON = {
    "walls": "wall",
    "ceiling": "ceiling",
    "furniture": "furniture",
    "tripods": "tripod",
    "by hand": "by hand",
}
"""Names of the kinds of places of ``pipeline.planning.plan.PlannedCamera``."""
SMALL_M, SMALL_M2 = 1.0, 0.1
"""Below these, lengths are in centimetres and areas in square centimetres."""
MOST_DECIMALS = 3
EVEN = 0.15
"""Share of the half interval by which its middle may differ from the value in a text with ±."""


def quantity_text(one: Quantity) -> str:
    """Return a number with its interval, such as ``20.3 ± 0.3 cm`` or ``20.3 cm (19.1 to 24.0)``.

    A length that was typed in has no interval: ``30 cm``.
    """
    value, low, high, unit, decimals = _shown(one)
    if high == low:
        return f"{value:g} {unit}"
    half = 0.5 * (high - low)
    if abs(0.5 * (low + high) - value) <= EVEN * half:
        gap = "" if unit == "°" else " "
        return f"{value:.{decimals}f} ± {half:.{decimals}f}{gap}{unit}"
    return f"{_with_unit(value, decimals, unit)} ({low:.{decimals}f} to {high:.{decimals}f})"


def short_text(quantities: Sequence[Quantity]) -> str:
    """Return numbers for a label in the scene: one with its interval, or the sides of a box without."""
    if len(quantities) == 1:
        return quantity_text(quantities[0])
    unit = "m" if any(one.value >= SMALL_M for one in quantities) else "cm"
    per_m = 1.0 if unit == "m" else 100.0
    decimals = min(_decimals(0.5 * per_m * (one.high - one.low)) for one in quantities)
    return " × ".join(f"{per_m * one.value:.{decimals}f}" for one in quantities) + f" {unit}"


def _shown(one: Quantity) -> tuple[float, float, float, str, int]:
    """Return value and interval in the unit that fits, the unit, and the decimals to show."""
    scale, unit = 1.0, "°"
    if one.unit == "m":
        scale, unit = (100.0, "cm") if abs(one.value) < SMALL_M else (1.0, "m")
    elif one.unit == "m2":
        scale, unit = (1e4, "cm²") if one.value < SMALL_M2 else (1.0, "m²")
    value, low, high = (scale * number for number in (one.value, one.low, one.high))
    return value, low, high, unit, _decimals(0.5 * (high - low))


def _decimals(half: float) -> int:
    """Return decimals that show one or two digits of half an interval."""
    if not (math.isfinite(half) and half > 0.0):
        return 1
    return min(max(0, -math.floor(math.log10(0.5 * half))), MOST_DECIMALS)


def _with_unit(value: float, decimals: int, unit: str) -> str:
    return f"{value:.{decimals}f}{'' if unit == '°' else ' '}{unit}"
