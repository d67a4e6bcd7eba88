"""What the thesis prints of its noise experiment (Table 4.1), beside which ours is shown."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

NAMES = ("fx", "fy", "cx", "cy", "k1", "k2")
TRUE = (500.0, 500.0, 300.0, 250.0, 0.05, 0.1)
"""Of its camera."""
TABLE_4_1 = {
    0.2: (500.013, 500.009, 300.132, 249.855, 0.0503, 0.1023),
    0.4: (499.738, 500.343, 300.273, 249.762, 0.0443, 0.1048),
    0.6: (498.836, 501.538, 299.317, 249.346, 0.0634, 0.0936),
    0.8: (501.329, 500.938, 299.021, 250.829, 0.0849, 0.1274),
    1.0: (502.474, 497.638, 301.327, 251.043, 0.1382, 0.0632),
}
"""By the noise in px: one estimate for each."""


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
