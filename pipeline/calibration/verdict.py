"""Pass or fail of a camera in plain words, at the distance and accuracy that the user needs (SPEC 1.3)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from packetmesh.errors import InputError
from pipeline.calibration.estimate import Calibration
from pipeline.calibration.likely_error import LikelyError
from pipeline.calibration.next_view import NextView
from pipeline.config import Lens
from pipeline.types import FloatArray

LEAST_SHARE = 0.95
"""Share of the image in which points must be accurate enough."""
LEVEL = 0.95
"""Probability with which stated errors are not exceeded."""
PASS, FAIL = 0.75, 0.25
"""A camera passes if the probability that it is accurate enough is at least the first, and fails if it is at
most the second; between them its views do not decide (chosen by the sessions of seed 100 of
``python -m lab.verdicts``)."""
CERTAIN = 0.95
"""Least probability at which a wrong lens model or a bent board is named."""
LENS_REMEDY: dict[Lens, str] = {
    "thesis": "try --lens brown",
    "brown": "try --lens rational",
    "rational": "try --lens fisheye if the lens is one, or sharper images",
    "fisheye": "try --lens rational, or sharper images",
}
"""Advice if the residuals have a pattern: a lens model with more parameters, or of another kind."""


@dataclass(frozen=True, slots=True)
class Verdict:
    """Whether a camera is accurate enough."""

    probability: float
    """Probability that points are within ``accuracy_m`` over ``LEAST_SHARE`` of the image."""
    range_m: float
    accuracy_m: float
    error_m: FloatArray
    """(R, C) error in the map's cells that is not exceeded with the probability ``LEVEL``; NaN without a
    ray.
    """
    share: float
    """Share of the image in which points are within ``accuracy_m``, with the probability ``LEVEL``."""
    error_of_most_m: float
    """Error that is not exceeded over ``LEAST_SHARE`` of the image, with the probability ``LEVEL``; infinite
    if too much of the image has no rays."""
    wrong_lens: float
    """Probability that the lens model does not fit the lens."""
    bent: float
    """Probability that the board is bent."""
    sentence: str
    """Summary and advice."""

    @property
    def passed(self) -> bool:
        """Whether the camera is accurate enough."""
        return self.probability >= PASS

    @property
    def failed(self) -> bool:
        """Whether the camera is not accurate enough; False also if the views do not decide."""
        return self.probability <= FAIL

    @property
    def word(self) -> str:
        """The verdict: pass, fail or not decided."""
        return _word(self.probability)


def verdict(
    calibration: Calibration,
    likely: LikelyError,
    accuracy_m: float,
    following: NextView | None = None,
    outliers: Sequence[str] = (),
) -> Verdict:
    """Judge a camera at the distance of its likely error.

    Args:
        calibration: the camera.
        likely: result of ``likely_error``.
        accuracy_m: largest accepted error of a point.
        following: the best view to take next, for the advice; None if there is none.
        outliers: names of views that do not fit the others.

    Raises:
        InputError: the accuracy is impossible.
    """
    if not accuracy_m > 0.0:
        raise InputError(f"An accuracy of {1000.0 * accuracy_m:g} mm cannot be met; try 5")
    probability = likely.within(accuracy_m, LEAST_SHARE)
    of_most_m = likely.of_share_m(LEAST_SHARE, LEVEL)
    sentence = (
        f"At {likely.range_m:g} m a point is placed within {_mm(accuracy_m)} over "
        f"{100.0 * LEAST_SHARE:.0f} % of "
        f"the image with a probability of {percent(probability)}, {_over_most(likely, of_most_m)}: "
        f"{_word(probability)}."
    )
    advice = [] if probability >= PASS else _advice(calibration, likely, following, outliers)
    return Verdict(
        *(probability, likely.range_m, accuracy_m, likely.map_m(LEVEL)),
        *(likely.share_within(accuracy_m, LEVEL), of_most_m, likely.wrong_lens, likely.bent),
        " ".join([sentence, *advice]),
    )


def percent(probability: float) -> str:
    """Return a probability from random draws in whole per cent, never as 0 or 100 %."""
    if probability < 0.01:
        return "below 1 %"
    return "above 99 %" if probability > 0.99 else f"{100.0 * probability:.0f} %"


def _word(probability: float) -> str:
    return "pass" if probability >= PASS else "fail" if probability <= FAIL else "not decided"


def _advice(
    calibration: Calibration, likely: LikelyError, following: NextView | None, outliers: Sequence[str]
) -> list[str]:
    """Return sentences on what to change: wrong views, the lens model, the board, or more views."""
    advice = []
    if likely.wrong_lens >= CERTAIN:
        advice.append(
            f"The residuals have a pattern over the image that the lens model '{calibration.lens}' does "
            f"not explain: {LENS_REMEDY[calibration.lens]}."
        )
    if likely.bent >= CERTAIN:
        remedy = (
            "glue it onto a flat plate"
            if calibration.lens == "fisheye"
            else ("glue it onto a flat plate, or try --board-warp (one camera at a time)")
        )
        advice.append(f"The residuals have the pattern of a bent board: {remedy}.")
    if advice and outliers:  # a wrong view looks like a wrong lens or a bent board
        which = f"{outliers[0]} does" if len(outliers) == 1 else f"{len(outliers)} images do"
        return [f"{which} not fit the others: leave out what is wrong, then judge again."]
    if advice:
        return advice
    if following is None:
        return ["Take more views, near the edges of the image."]
    x, y = following.points_px.mean(axis=0) / calibration.size_px
    where = " ".join(dict.fromkeys((_third(y, "upper", "lower"), _third(x, "left", "right"))))
    return [
        f"Next, hold the board {following.distance_m:.2f} m away in the {where} of the image, tilted by "
        f"{following.tilt_deg:.0f}°: that is predicted to bring the error over the whole "
        f"image from {_mm(following.error_before_m)} to {_mm(following.error_after_m)}."
    ]


def _over_most(likely: LikelyError, of_most_m: float) -> str:
    if np.isfinite(of_most_m):
        return f"and within {_mm(of_most_m)} with a probability of {100.0 * LEVEL:.0f} %"
    missing = np.isnan(likely.map_m(LEVEL)).mean()
    return f"and not at all in {100.0 * missing:.0f} % of it, where this lens has no rays"


def _third(share: float, low: str, high: str) -> str:
    return low if share < 0.4 else high if share > 0.6 else "middle"


def _mm(length_m: float) -> str:
    return f"{1000.0 * length_m:.2g} mm" if length_m < 0.1 else f"{length_m:.2g} m"
