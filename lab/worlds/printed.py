"""Picture of a calibration board's printed sheet, and positions of the sheet in the board's frame."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from pipeline.calibration.board import Board
from pipeline.calibration.target import picture_of, place_of_first_mm, sheet
from pipeline.types import ByteArray, FloatArray

PIXEL_MM = 0.25
"""Pixel size of the print's picture."""


@lru_cache(4)
def printed(board: Board) -> ByteArray:
    """Return the (H, W) grey picture of the sheet, with pixels of ``PIXEL_MM``."""
    return picture_of(sheet(board), PIXEL_MM)


def sheet_px(board: Board, flat_m: FloatArray) -> FloatArray:
    """Return (N, 2) pixels in ``printed`` of (N, 2) positions in the board's plane, metres."""
    first_mm = 1000.0 * board.points_m[0, :2]
    return (1000.0 * flat_m - first_mm + place_of_first_mm(board)) / PIXEL_MM - 0.5


def sheet_corners_m(board: Board) -> FloatArray:
    """Return the (4, 3) corners of the sheet in the board's frame, clockwise from the upper left."""
    whole = sheet(board)
    low_m = board.points_m[0, :2] - place_of_first_mm(board) / 1000.0
    high_m = low_m + np.array([whole.width_mm, whole.height_mm]) / 1000.0
    (left, top), (right, bottom) = low_m, high_m
    return np.array([[left, top, 0.0], [right, top, 0.0], [right, bottom, 0.0], [left, bottom, 0.0]])
