"""A calibration board as it lies on its sheet of paper."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from pipeline.calibration.board import Board
from pipeline.calibration.target import picture_of, place_of_first_mm, sheet
from pipeline.types import ByteArray, FloatArray

PIXEL_MM = 0.25
"""Of the print that is looked at."""


@lru_cache(4)
def printed(board: Board) -> ByteArray:
    """(H, W) grey picture of the sheet, pixels of ``PIXEL_MM``."""
    return picture_of(sheet(board), PIXEL_MM)


def sheet_px(board: Board, flat_m: FloatArray) -> FloatArray:
    """(N, 2) where in ``printed`` places (N, 2) of the board's plane are."""
    first_mm = 1000.0 * board.points_m[0, :2]
    return (1000.0 * flat_m - first_mm + place_of_first_mm(board)) / PIXEL_MM - 0.5


def sheet_corners_m(board: Board) -> FloatArray:
    """(4, 3) corners of the sheet in the board's frame, around it."""
    whole = sheet(board)
    low_m = board.points_m[0, :2] - place_of_first_mm(board) / 1000.0
    high_m = low_m + np.array([whole.width_mm, whole.height_mm]) / 1000.0
    (left, top), (right, bottom) = low_m, high_m
    return np.array([[left, top, 0.0], [right, top, 0.0], [right, bottom, 0.0], [left, bottom, 0.0]])
