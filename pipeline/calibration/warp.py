"""Estimation of a warped board's shape together with the lens (Strobl and Hirzinger, "More accurate pinhole
camera calibration with imperfect planar target", ICCV workshops 2011).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np

from packetmesh.errors import InputError, ReconstructionError
from pipeline.calibration.board import Board
from pipeline.calibration.estimate import (
    LEAST_VIEWS,
    Calibration,
    FittedView,
    View,
    calibration_of,
    held_out,
    place,
    pose_of,
    rms_px,
)
from pipeline.calibration.lens import FLAGS, Optics
from pipeline.calibration.one_thread import one_thread
from pipeline.config import Lens
from pipeline.types import FloatArray


@dataclass(frozen=True, slots=True)
class BoardWarp:
    """The estimated shape of a board."""

    board_m: FloatArray
    """(N, 3) points of the board; the first, the upper right and the height of the last define its frame and
    scale."""
    off_plane_m: FloatArray
    """(N,) distances of the points from their best-fitting plane, along z."""
    calibration: Calibration
    """Calibration of the camera with this board; its covariance assumes that the board is known."""
    held_out: tuple[FittedView, ...]
    """Held-out views, fitted with a lens and board estimated without them."""
    flat_rms_px: float
    """RMS of held-out views with a flat board."""

    @property
    def warp_m(self) -> float:
        """Distance between the deepest and the highest point of the board, along z."""
        return float(np.ptp(self.off_plane_m))

    @property
    def rms_px(self) -> float:
        """RMS of held-out views with this board."""
        return rms_px(np.concatenate([view.residuals_px for view in self.held_out]))

    @property
    def helps(self) -> bool:
        """Whether this board predicts held-out views better than a flat one."""
        return self.rms_px < self.flat_rms_px


def board_warp(
    views: Sequence[View], size_px: tuple[int, int], board: Board, folds: int, lens: Lens = "thesis"
) -> BoardWarp:
    """Estimate the board's points with the lens, and test both on held-out views.

    Args:
        views: views that show all points of the board.
        size_px: width and height of the images.
        board: the board as printed.
        folds: number of folds of held-out views, at least 2.
        lens: distortion model of the camera.

    Raises:
        InputError: the lens is a fisheye, a view shows only part of the board, or the folds need more
            views.
        ReconstructionError: the views do not determine lens and board.
    """
    if lens == "fisheye":
        raise InputError("A board's warp cannot be found with a fisheye lens; try the lens 'rational'")
    if len(views) <= LEAST_VIEWS:
        raise InputError(
            f"A board's warp takes {LEAST_VIEWS + 1} views, because some are held out, and {len(views)} are "
            "given; take more, or assume that the board is flat"
        )
    if any(len(view.points_px) != len(board.points_m) for view in views):
        raise InputError("A board's warp needs views of the whole board; leave out those of a part of it")
    flat = held_out(views, size_px, folds, lens)
    calibration, board_m = _released(views, size_px, board, lens)
    placed: dict[int, FittedView] = {}
    for fold in range(folds):
        rest, rest_board_m = _released(
            [view for row, view in enumerate(views) if row % folds != fold], size_px, board, lens
        )
        for row in range(fold, len(views), folds):
            unseen = replace(views[row], board_m=rest_board_m)
            placed[row] = place(unseen, rest.matrix, rest.distortion, lens)
    return BoardWarp(
        board_m,
        _off_plane_m(board_m),
        calibration,
        tuple(placed[row] for row in range(len(views))),
        rms_px(np.concatenate([view.residuals_px for view in flat])),
    )


def _released(
    views: Sequence[View], size_px: tuple[int, int], board: Board, lens: Lens
) -> tuple[Calibration, FloatArray]:
    """Estimate the camera and the (N, 3) points of the board."""
    upper_right = board.grid[0] - 1
    try:
        with one_thread():
            _, matrix, distortion, turns, moves, board_m, *_ = cv2.calibrateCameraROExtended(
                [view.board_m.astype(np.float32) for view in views],
                [view.points_px.astype(np.float32).reshape(-1, 1, 2) for view in views],
                size_px,
                upper_right,
                None,
                None,
                flags=FLAGS[lens] | cv2.CALIB_USE_LU,
            )
    except cv2.error:
        raise ReconstructionError(
            "The views do not determine lens and board together; take more, tilted to all sides, or "
            "assume that the board is flat"
        ) from None
    board_m = np.asarray(board_m, float).reshape(-1, 3)
    bent = [replace(view, board_m=board_m) for view in views]
    poses = [pose_of(turn, move) for turn, move in zip(turns, moves, strict=True)]
    return calibration_of(bent, poses, Optics(lens, matrix, distortion.ravel()), size_px), board_m


def _off_plane_m(board_m: FloatArray) -> FloatArray:
    base = np.column_stack([board_m[:, :2], np.ones(len(board_m))])
    return board_m[:, 2] - base @ np.linalg.lstsq(base, board_m[:, 2], rcond=None)[0]
