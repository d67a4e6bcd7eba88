"""Assessment of a calibrated camera at a working distance, in one record (issue 14)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from packetmesh.errors import ReconstructionError
from pipeline.calibration.board import Board
from pipeline.calibration.diagnosis import Coverage, coverage
from pipeline.calibration.estimate import LEAST_VIEWS, Calibration, View
from pipeline.calibration.likely_error import likely_error
from pipeline.calibration.next_view import NextView, next_view
from pipeline.calibration.outliers import OutlierView, outlier_views
from pipeline.calibration.trust import ErrorMap, HalfDifference, half_difference_px, projected_sd_px
from pipeline.calibration.verdict import Verdict, verdict


@dataclass(frozen=True, slots=True)
class Trust:
    """Accuracy of a camera at a working distance."""

    sd: ErrorMap
    """Standard deviation of the error due to noise."""
    halves: HalfDifference | None
    """Difference of two halves of the views; None with too few views, or if a half determines no lens."""
    coverage: Coverage
    outliers: tuple[OutlierView, ...]
    following: NextView | None
    """The best view to take next; None if the board fits nowhere into the image."""
    verdict: Verdict

    def metrics(self) -> dict[str, Any]:
        """Return the values that ``--json`` prints."""
        judged, sd, halves, following = self.verdict, self.sd, self.halves, self.following
        return {
            "range_m": judged.range_m,
            "accuracy_m": judged.accuracy_m,
            "passed": judged.passed,
            "failed": judged.failed,
            "probability": judged.probability,
            "sentence": judged.sentence,
            "share_within": judged.share,
            "error_of_most_m": judged.error_of_most_m,
            "wrong_lens": judged.wrong_lens,
            "bent_board": judged.bent,
            "uncertainty_px": _summary(sd.error_px),
            "uncertainty_m": _summary(sd.error_m),
            "halves": halves
            and {
                "ratio": halves.ratio,
                "most_by_noise": halves.most_by_noise,
                "beyond_noise": halves.beyond_noise,
                "difference_px": _summary(halves.map.error_px),
                "difference_m": _summary(halves.map.error_m),
            },
            "coverage": self.coverage.share,
            "outliers": [
                {"image": one.name, "rms_px": one.rms_px, "others_px": one.others_px, "reason": one.reason}
                for one in self.outliers
            ],
            "next_view": following
            and {
                "T_camera_board": following.T_camera_board.tolist(),
                "outline_px": following.outline_px.tolist(),
                "distance_m": following.distance_m,
                "tilt_deg": following.tilt_deg,
                "error_before_m": following.error_before_m,
                "error_after_m": following.error_after_m,
            },
        }


def assess(
    calibration: Calibration, views: Sequence[View], board: Board, range_m: float, accuracy_m: float
) -> Trust:
    """Assess a camera at its working distance.

    Args:
        calibration: the camera.
        views: the views of its calibration, in any order.
        board: the board in the views.
        range_m: distance of the surfaces that the camera will measure.
        accuracy_m: largest accepted error of a point.

    Raises:
        InputError: the range or the accuracy is impossible.
    """
    sd = projected_sd_px(calibration, range_m)
    halves = following = None
    if len(views) >= 2 * LEAST_VIEWS:
        try:
            halves = half_difference_px(views, calibration.size_px, range_m, calibration.lens)
        except (ReconstructionError, np.linalg.LinAlgError):
            halves = None
    try:
        following = next_view(calibration, board, range_m)
    except ReconstructionError:
        following = None
    outliers = outlier_views(calibration, views)
    likely, names = likely_error(calibration, range_m), [one.name for one in outliers]
    return Trust(
        sd,
        halves,
        coverage(calibration.views, calibration.size_px),
        outliers,
        following,
        verdict(calibration, likely, accuracy_m, following, names),
    )


def _summary(values: np.ndarray) -> dict[str, float]:
    """Return the median and the maximum over the pixels that have rays; empty if there are none."""
    known = values[np.isfinite(values)]
    return {"median": float(np.median(known)), "most": float(known.max())} if len(known) else {}
