"""Correlations of the errors of a camera's parameters: the views hardly separate two parameters of strong
correlation (SPEC 1.3 d).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pipeline.calibration.estimate import Calibration, FittedView, coordinate_sd_px
from pipeline.calibration.lens import Optics
from pipeline.types import FloatArray

DISTANCE = "distance"
"""Mean distance of the board from the camera: not a lens parameter, but the quantity with which a focal
length is confused most easily."""


@dataclass(frozen=True, slots=True)
class Pair:
    """Two parameters and their correlation."""

    first: str
    second: str
    correlation: float
    """Correlation, -1 to 1."""


@dataclass(frozen=True, slots=True)
class Correlations:
    """Correlations of all parameters' errors."""

    names: tuple[str, ...]
    """Names of the lens's parameters, then the board's distance."""
    matrix: FloatArray
    """(P, P) correlations, -1 to 1."""

    @property
    def strongest(self) -> Pair:
        """The pair that the views separate least."""
        size = np.abs(np.tril(self.matrix, -1))
        row, column = np.unravel_index(int(size.argmax()), size.shape)
        return Pair(self.names[column], self.names[row], float(self.matrix[row, column]))


def correlations(lens: Calibration) -> Correlations:
    """Compute the correlations of the errors of a camera's parameters and of the board's distance.

    The error of a view's distance has a part of its own and a part due to the error of the lens, whose
    covariance already includes the poses. Both parts of the mean distance are summed over the views.
    """
    noise = coordinate_sd_px(lens.views, lens.lens) ** 2
    count = len(lens.views)
    by_lens, own = np.zeros(len(lens.names)), 0.0
    for view in lens.views:
        slope, variance = _distance(view, lens.optics)
        by_lens += slope / count
        own += noise * variance / count**2
    across = lens.covariance @ by_lens
    joint = np.block(
        [[lens.covariance, across[:, None]], [across[None], np.atleast_2d(own + by_lens @ across)]]
    )
    sd = np.sqrt(np.diag(joint))
    return Correlations((*lens.names, DISTANCE), np.clip(joint / np.outer(sd, sd), -1.0, 1.0))


def _distance(view: FittedView, optics: Optics) -> tuple[FloatArray, float]:
    """Return the (P,) derivative of a view's distance (m) by the lens, with its pose refitted, and the
    distance's own variance for noise of 1 px.
    """
    linear = optics.linearised(view.board_m, view.T_camera_board)
    away = view.T_camera_board[:3, 3]
    outward = np.concatenate([np.zeros(3), away / np.linalg.norm(away)])
    known = np.linalg.solve(linear.by_pose.T @ linear.by_pose, outward)
    return -linear.by_lens.T @ (linear.by_pose @ known), float(outward @ known)
