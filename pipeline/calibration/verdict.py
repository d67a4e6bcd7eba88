"""Pass or fail of a camera in plain words, at the distance and accuracy that the user needs (SPEC 1.3)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from packetmesh.errors import InputError
from pipeline.calibration.estimate import Calibration
from pipeline.calibration.next_view import NextView
from pipeline.calibration.trust import CIRCLE95, ErrorMap, HalfDifference
from pipeline.config import Lens
from pipeline.types import FloatArray

LEAST_SHARE = 0.95
"""Share of the image in which points must be accurate enough."""
RICHER: dict[Lens, Lens] = {"thesis": "brown", "brown": "rational"}
"""Lens models with more parameters."""


@dataclass(frozen=True, slots=True)
class Verdict:
    """Whether a camera is accurate enough."""

    passed: bool
    range_m: float
    accuracy_m: float
    error_m: FloatArray
    """(R, C) error in the map's cells that is not exceeded in 95 of 100 cases; NaN without a ray."""
    share: float
    """Share of the image in which this error is at most ``accuracy_m``."""
    error_of_most_m: float
    """Error that is not exceeded over ``LEAST_SHARE`` of the image; infinite if too much has no rays."""
    sentence: str
    """Summary and advice."""


def verdict(
    calibration: Calibration,
    sd: ErrorMap,
    halves: HalfDifference | None,
    accuracy_m: float,
    following: NextView | None = None,
) -> Verdict:
    """Judge a camera at the distance of its maps.

    The error of a cell is that of noise; if the two halves of the views differ by more than noise, it is at
    least their difference.

    Args:
        calibration: the camera.
        sd: result of ``projected_sd_px``.
        halves: result of ``half_difference_px``; None with too few views.
        accuracy_m: largest error of a point that is accepted.
        following: the best view to take next, for the advice.

    Raises:
        InputError: the accuracy is impossible.
    """
    if not accuracy_m > 0.0:
        raise InputError(f"An accuracy of {1000.0 * accuracy_m:g} mm cannot be met; try 5")
    error_m = CIRCLE95 * sd.error_m
    differ = halves is not None and halves.beyond_noise
    if halves is not None and differ:
        error_m = np.maximum(error_m, halves.map.error_m)
    placed = np.where(np.isfinite(error_m), error_m, np.inf)
    share = float((placed <= accuracy_m).mean())
    of_most_m = float(np.quantile(placed, LEAST_SHARE, method="higher"))
    passed = share >= LEAST_SHARE
    told = (
        f"At {sd.range_m:g} m a point is placed within {_mm(accuracy_m)} (95 %) over {100.0 * share:.0f} % "
        f"of the image, {_over_most(placed, of_most_m)}: {'pass' if passed else 'fail'}."
    )
    advice = [] if passed else _advice(calibration, halves, following)
    return Verdict(passed, sd.range_m, accuracy_m, error_m, share, of_most_m, " ".join([told, *advice]))


def _advice(calibration: Calibration, halves: HalfDifference | None, following: NextView | None) -> list[str]:
    if halves is not None and halves.beyond_noise:
        richer = RICHER.get(calibration.lens)
        lens = f"--lens {richer}, " if richer else ""
        return [
            f"Two halves of the views differ by {halves.ratio:.1f} times what noise explains (by chance up "
            f"to {halves.most_by_noise:.1f}): try {lens}--board-warp (one camera at a time), or leave out "
            "views that stand out."
        ]
    if following is None:
        return ["Take more views, near the edges of the image."]
    x, y = following.points_px.mean(axis=0) / calibration.size_px
    where = " ".join(dict.fromkeys((_third(y, "upper", "lower"), _third(x, "left", "right"))))
    return [
        f"Next, hold the board {following.distance_m:.2f} m away in the {where} of the image, tilted by "
        f"{following.tilt_deg:.0f}°: that is predicted to bring the error over the whole "
        f"image from {_mm(following.error_before_m)} to {_mm(following.error_after_m)}."
    ]


def _over_most(placed_m: FloatArray, of_most_m: float) -> str:
    if np.isfinite(of_most_m):
        return f"and within {_mm(of_most_m)} over {100.0 * LEAST_SHARE:.0f} % of it"
    return f"and not at all in {100.0 * np.isinf(placed_m).mean():.0f} % of it, where this lens has no rays"


def _third(share: float, low: str, high: str) -> str:
    return low if share < 0.4 else high if share > 0.6 else "middle"


def _mm(length_m: float) -> str:
    return f"{1000.0 * length_m:.2g} mm" if length_m < 0.1 else f"{length_m:.2g} m"
