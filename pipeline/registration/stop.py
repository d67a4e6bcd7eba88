"""Stop rule of the registration loop (SPEC 4.2)."""

from __future__ import annotations

from dataclasses import dataclass

from pipeline.types import RegistrationStep

ROTATION_TOLERANCE_RAD = 1e-4
TRANSLATION_TOLERANCE_OF_GATE = 1e-4 / 0.3
"""1e-4 m at the default gate of 0.3 m; relative, so that the unit of length does not matter."""
RMSE_TOLERANCE = 1e-6
"""Relative change below which the RMSE counts as constant."""
STILL_STEPS = 2
"""Number of consecutive steps with constant RMSE after which the registration has stalled."""


@dataclass(slots=True)
class StopRule:
    """Decides after every step whether the registration has converged or stalled."""

    translation_tolerance_m: float
    _rmse_m: float = float("nan")
    _still_steps: int = 0

    def reason(self, step: RegistrationStep, tolerance: float = 1.0) -> str | None:
        """Return ``converged`` after a negligible motion, ``stalled`` after constant RMSE, else None.

        ``tolerance`` is a factor on all tolerances.
        """
        still = abs(self._rmse_m - step.rmse_m) <= tolerance * RMSE_TOLERANCE * self._rmse_m
        self._still_steps = self._still_steps + 1 if still else 0
        self._rmse_m = step.rmse_m
        if (
            step.rotation_step_rad < tolerance * ROTATION_TOLERANCE_RAD
            and step.translation_step_m < tolerance * self.translation_tolerance_m
        ):
            return "converged"
        return "stalled" if self._still_steps >= STILL_STEPS else None
