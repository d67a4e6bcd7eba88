"""Views that do not fit the others: proposed with a reason, and never left out by themselves (issue 14)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from packetmesh.errors import ReconstructionError
from pipeline.calibration.estimate import LEAST_VIEWS, Calibration, View, calibrate

MOST_SDS = 3.5
"""Robust standard deviations of the logarithm of a view's RMS above the median: then it stands out."""
LEAST_SD = 0.2
"""Of that logarithm, so that no view stands out whose error is less than twice the others'."""


@dataclass(frozen=True, slots=True)
class OutlierView:
    """A view that one may leave out."""

    name: str
    rms_px: float
    """Its own."""
    others_px: float
    """The median of the others."""
    rms_without_px: float
    """Of the others, if the lens does without it."""
    lens_moves_sd: float
    """The most that a parameter of the lens then changes, in its standard errors."""

    @property
    def reason(self) -> str:
        """In a sentence."""
        return (
            f"{self.name} has {self.rms_px:.2f} px where the others have {self.others_px:.2f}; without it "
            f"the camera changes by {self.lens_moves_sd:.1f} standard errors and the others come to "
            f"{self.rms_without_px:.2f} px. Is it blurred, another board, or a wrong order?"
        )


def outlier_views(calibration: Calibration, views: Sequence[View]) -> tuple[OutlierView, ...]:
    """Views whose error stands out, the worst first.

    One wrong view spoils the fit of all, so they are found one after the other, each in a lens without those
    found before.

    Args:
        calibration: of all views.
        views: those that it comes from.
    """
    found: list[OutlierView] = []
    now, left = calibration, list(views)
    while len(left) > LEAST_VIEWS + 1:
        errors_px = np.array([view.rms_px for view in now.views])
        worst = int(np.argmax(errors_px))
        others_px = np.median(np.delete(errors_px, worst))
        if not _stands_out(errors_px, worst):
            break
        left = [view for row, view in enumerate(left) if row != worst]
        try:
            without = calibrate(left, calibration.size_px, calibration.lens)
        except ReconstructionError:
            break
        moved = [
            abs(now.parameters[name] - without.parameters[name]) / max(error, 1e-12)
            for name, error in without.standard_errors.items()
        ]
        found.append(
            OutlierView(
                now.views[worst].name, float(errors_px[worst]), float(others_px), without.rms_px, max(moved)
            )
        )
        now = without
    return tuple(found)


def _stands_out(errors_px: np.ndarray, row: int) -> bool:
    """Whether a view's error is far above those of the others."""
    others = np.log(np.maximum(np.delete(errors_px, row), 1e-6))
    middle = np.median(others)
    sd = max(1.4826 * float(np.median(np.abs(others - middle))), LEAST_SD)
    return bool(np.log(max(errors_px[row], 1e-6)) > middle + MOST_SDS * sd)
