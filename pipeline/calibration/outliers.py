"""Detection of views that do not fit the others, with a reason; only the user excludes them (issue 14)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from packetmesh.errors import ReconstructionError
from pipeline.calibration.estimate import LEAST_VIEWS, Calibration, View, best_fit

MOST_SDS = 3.5
"""A view stands out if its log RMS is this many robust standard deviations above the others' median."""
LEAST_SD = 0.2
"""Least standard deviation of log RMS, so that no view with less than twice the others' error stands out."""


@dataclass(frozen=True, slots=True)
class OutlierView:
    """A view that the user may exclude."""

    name: str
    rms_px: float
    """RMS of the view."""
    others_px: float
    """Median RMS of the others."""
    rms_without_px: float
    """RMS of the others if the lens is estimated without the view."""
    lens_moves_sd: float
    """Largest change of a lens parameter if the view is left out, in its standard errors."""

    @property
    def reason(self) -> str:
        """Sentence with the reason."""
        return (
            f"{self.name} has {self.rms_px:.2f} px where the others have {self.others_px:.2f}; without it "
            f"the camera changes by {self.lens_moves_sd:.1f} standard errors and the others come to "
            f"{self.rms_without_px:.2f} px. Check whether it is blurred, shows another board, or has "
            "its points in a wrong order."
        )


def outlier_views(calibration: Calibration, views: Sequence[View]) -> tuple[OutlierView, ...]:
    """Find the views whose error stands out, the worst first.

    Because one wrong view affects the fit of all, outliers are found one after the other, each with a lens
    estimated without those found before.

    Args:
        calibration: calibration from all views.
        views: the same views, in any order.
    """
    found: list[OutlierView] = []
    now, left = calibration, list(views)
    while len(left) > LEAST_VIEWS + 1:
        errors_px = np.array([view.rms_px for view in now.views])
        worst = int(np.argmax(errors_px))
        name = now.views[worst].name
        others_px = np.median(np.delete(errors_px, worst))
        if not _stands_out(errors_px, worst):
            break
        left = [view for view in left if view.name != name]
        try:
            without = best_fit(left, calibration.size_px, calibration.lens)
        except ReconstructionError:
            break
        moved = [
            abs(now.parameters[parameter] - without.parameters[parameter]) / max(error, 1e-12)
            for parameter, error in without.standard_errors.items()
        ]
        found.append(OutlierView(name, float(errors_px[worst]), float(others_px), without.rms_px, max(moved)))
        now = without
    return tuple(found)


def _stands_out(errors_px: np.ndarray, row: int) -> bool:
    """Return whether a view's error is far above those of the others."""
    others = np.log(np.maximum(np.delete(errors_px, row), 1e-6))
    middle = np.median(others)
    sd = max(1.4826 * float(np.median(np.abs(others - middle))), LEAST_SD)
    return bool(np.log(max(errors_px[row], 1e-6)) > middle + MOST_SDS * sd)
