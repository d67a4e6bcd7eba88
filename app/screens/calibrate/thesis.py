"""What the thesis prints of its noise experiment (Table 4.1), beside which ours is shown."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from pipeline.calibration.thesis_table import TABLE_4_1

NAMES = ("fx", "fy", "cx", "cy", "k1", "k2")
TRUE = (500.0, 500.0, 300.0, 250.0, 0.05, 0.1)
"""Of its camera."""


@dataclass(frozen=True, slots=True)
class Cell:
    """What the thesis found at the noise that is nearest to another."""

    sigma_px: float
    errors: dict[str, float]
    """By parameter: of k1 and k2 what it is off by, of the others as a share of the truth."""

    def error(self, name: str, true: float) -> float | None:
        """Of a camera like another; None of what the thesis does not estimate."""
        off = self.errors.get(name)
        return None if off is None else off if name.startswith("k") else off * true


def nearest_cell(sigma_px: float, parameters: Sequence[str]) -> Cell | None:
    """Of the noise that is nearest; None without noise, where the thesis finds the truth.

    Args:
        sigma_px: the noise.
        parameters: of the lens: beside a k4, its k1 and k2 are not what they are in the thesis's.
    """
    sigma = min(TABLE_4_1, key=lambda one: abs(one - sigma_px))
    if sigma_px < 0.5 * min(TABLE_4_1):
        return None
    printed = zip(NAMES, TABLE_4_1[sigma], TRUE, strict=True)
    errors = {
        name: value - true if name.startswith("k") else value / true - 1.0 for name, value, true in printed
    }
    if "k4" in parameters:
        del errors["k1"], errors["k2"]
    return Cell(sigma, errors)
