"""Refinement of circle centres without the bias of perspective: a tilted circle's image is an ellipse, whose
centre is not the image of the circle's centre (SPEC 1.2).
"""

from __future__ import annotations

import cv2
import numpy as np

from pipeline.calibration.board import Board
from pipeline.calibration.estimate import FittedView
from pipeline.calibration.lens import Optics
from pipeline.types import ByteArray, FloatArray

REACH = 0.5
"""Radius of a circle's neighbourhood, over the distance to its nearest neighbour."""
SAMPLES = (41, 121)
"""Least and most samples along the neighbourhood's diameter."""
PAPER = 0.86
"""Share of the neighbourhood's radius beyond which there is only paper."""
MIDDLE = 0.3
"""Share of the neighbourhood's radius that is inside a circle of any allowed size."""
RIM = 1.3
"""Radius up to which darkness belongs to a circle, over its radius: blur is within it, letters beyond."""
LEAST_CONTRAST = 10.0
"""Least difference in grey levels between circle and paper."""
MOST_SHIFT_PX = 1.0
"""Centres that move farther were disturbed, by glare or a shadow's edge, and keep their old position."""


def refined_px(gray: ByteArray, board: Board, view: FittedView, optics: Optics) -> FloatArray:
    """Return (N, 2) refined centres of a view's circles, pixels.

    Lens and pose rectify each circle's neighbourhood to a view perpendicular to the board; the centroid of
    darkness there (of brightness, on dark paper) is projected back to the image. Centres with too little
    contrast or too large a shift keep their old position.

    Args:
        gray: (H, W) uint8.
        board: a board of circles.
        view: detected circles and the board's pose.
        optics: the lens.
    """
    reach_m = REACH * board.nearest_m
    steps_m = np.linspace(-reach_m, reach_m, _samples(view, board))
    around_m = np.stack(np.meshgrid(steps_m, steps_m, [0.0]), axis=-1).reshape(-1, 3)
    away = np.linalg.norm(around_m, axis=1) / reach_m
    around_m, away = around_m[away <= 1.0], away[away <= 1.0]
    places_m = (view.board_m[:, None] + around_m).reshape(-1, 3)
    at_px = optics.project(places_m, view.T_camera_board).reshape(-1, len(around_m), 2).astype(np.float32)
    patches = cv2.remap(
        gray.astype(np.float32), at_px, None, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE
    )
    shifts_m = _centres_m(patches, around_m, away)
    moved_px = optics.project(view.board_m + np.nan_to_num(shifts_m), view.T_camera_board)
    shift_px = np.linalg.norm(moved_px - view.points_px, axis=1)
    good = np.isfinite(shifts_m[:, 0]) & (shift_px <= MOST_SHIFT_PX)
    return np.where(good[:, None], moved_px, view.points_px)


def _samples(view: FittedView, board: Board) -> int:
    """Return the number of samples along a neighbourhood's diameter, about one per pixel."""
    area_px2 = cv2.contourArea(cv2.convexHull(view.points_px.astype(np.float32)))
    area_m2 = cv2.contourArea(cv2.convexHull(view.board_m[:, :2].astype(np.float32)))
    side_px = 2.0 * REACH * board.nearest_m * (area_px2 / area_m2) ** 0.5
    return int(np.clip(round(side_px), *SAMPLES))


def _centres_m(patches: FloatArray, around_m: FloatArray, away: FloatArray) -> FloatArray:
    """Return (N, 3) centroids of darkness relative to paper with uneven light; NaN with too low contrast."""
    base = np.column_stack([around_m[:, :2], np.ones(len(around_m))])
    paper = away >= PAPER
    slopes = np.linalg.lstsq(base[paper], patches[:, paper].T, rcond=None)[0]
    differs = patches - (base @ slopes).T
    middle = np.median(differs[:, away <= MIDDLE], axis=1, keepdims=True)
    middle[np.abs(middle) < LEAST_CONTRAST] = np.nan
    weights = np.clip(differs / middle, 0.0, 1.0) * ~paper
    covered = weights.sum(axis=1)[np.isfinite(middle[:, 0])] / len(away)
    if len(covered):
        weights *= away <= RIM * np.median(covered) ** 0.5
    return weights @ around_m / weights.sum(axis=1, keepdims=True)
