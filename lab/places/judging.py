"""One program's answer on one pair, judged by the truth."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from lab.places.pairs import PlacesPair, Split
from pipeline.kernels.geometry import rotation_angle_rad
from pipeline.types import FloatArray

Verdict = Literal["sure", "doubtful", "none"]
RIGHT_DEG, RIGHT_M = 1.5, 0.05
"""Largest errors of a right answer: of the rotation, and of the position of the source's camera."""
_SIGMAS = 1.959964
"""Standard deviations of a 95 % interval."""


@dataclass(frozen=True, slots=True)
class PlacesTask:
    """A program and a pair, by the arguments of ``lab.places.pairs.pair``."""

    program: str
    split: Split
    index: int
    overlap: float | None


def judged(
    task: PlacesTask, pair: PlacesPair, T: FloatArray | None, verdict: Verdict | None, elapsed_s: float
) -> dict[str, Any]:
    """Return a row: the task, the true overlap, the errors, whether the answer is right, verdict and seconds.

    For views of different rooms, and without an answer (``T`` None), errors are None and ``right`` is False.
    """
    turn_deg, shift_m = pose_errors(T, pair.T_target_source)
    within = turn_deg is not None and shift_m is not None and turn_deg <= RIGHT_DEG and shift_m <= RIGHT_M
    return {
        "program": task.program,
        "index": task.index,
        "overlap": task.overlap,
        "overlap_share": pair.overlap_share,
        "turn_deg": turn_deg,
        "shift_m": shift_m,
        "right": within,
        "verdict": verdict,
        "elapsed_s": elapsed_s,
    }


def pose_errors(T: FloatArray | None, T_true: FloatArray | None) -> tuple[float | None, float | None]:
    """Return the angle in degrees and the distance in metres between two poses; None if one is missing."""
    if T is None or T_true is None:
        return None, None
    turn_rad = rotation_angle_rad(T[:3, :3].T @ T_true[:3, :3])
    return float(np.degrees(turn_rad)), float(np.linalg.norm(T[:3, 3] - T_true[:3, 3]))


def wilson(count: int, of: int) -> tuple[float, float]:
    """Return the 95 % interval of a share by Wilson (1927); 0 to 1 if ``of`` is 0.

    >>> [round(edge, 3) for edge in wilson(5, 10)]
    [0.237, 0.763]
    """
    if not of:
        return 0.0, 1.0
    share, spread = count / of, _SIGMAS**2 / of
    middle = (share + 0.5 * spread) / (1.0 + spread)
    half = np.sqrt(spread * (share * (1.0 - share) + 0.25 * spread)) / (1.0 + spread)
    return max(0.0, float(middle - half)), min(1.0, float(middle + half))
