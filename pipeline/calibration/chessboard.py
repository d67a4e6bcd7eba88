"""Detection of chessboards (SPEC 1.2). The points are never mirrored."""

from __future__ import annotations

from collections.abc import Callable

import cv2
import numpy as np

from pipeline.calibration.board import MOST_POINTS, Board
from pipeline.calibration.detection import Detection, brightness, not_found, whole
from pipeline.calibration.dictionaries import APRILGRID
from pipeline.calibration.grid_order import even_steps, upright_orders
from pipeline.calibration.markers import dictionaries_in
from pipeline.types import ByteArray, FloatArray

CORNER_WINDOW_PX = 5
LEAST_SIDE = 3
"""Least columns and rows of a chessboard of any size."""
USUAL = ("5X5_1000", "4X4_1000", "6X6_1000", APRILGRID)
"""Dictionaries whose markers are searched if no chessboard is found."""
ALTERNATES = 0.75
"""Least ratio of the contrast of alternating squares at a row of corners to that at the next row inside; the
ratio is 1 at corners, and 0.5 at the board's rim."""
INTO_A_SQUARE = 0.3
"""Distance from a corner, in squares, at which brightness is read; the outermost squares may be narrow."""


def find_chessboard(gray: ByteArray, board: Board) -> Detection:
    """Find a chessboard by several detectors in turn.

    Args:
        gray: (H, W) uint8.
        board: the board to find.
    """
    found, goes_on = _found(gray, board)
    return not_found(_why_not(gray, board, goes_on)) if found is None else found


def _found(gray: ByteArray, board: Board) -> tuple[Detection | None, bool]:
    """Return the detection, or None, and whether a part of a larger board was found."""
    ways: tuple[Callable[[], tuple[bool, FloatArray | None]], ...] = (
        lambda: cv2.findChessboardCornersSB(gray, board.size, flags=cv2.CALIB_CB_ACCURACY),
        lambda: cv2.findChessboardCornersSB(
            gray, board.size, flags=cv2.CALIB_CB_EXHAUSTIVE | cv2.CALIB_CB_NORMALIZE_IMAGE
        ),
        lambda: _refined(gray, board),
    )
    goes_on = False
    for find in ways:
        found, corners = find()
        if not found or corners is None:
            continue
        points_px = np.asarray(corners, float).reshape(-1, 2)
        if not even_steps(points_px, board):
            continue
        inside, beyond = _alternation(gray, board, points_px)
        if beyond.max() > ALTERNATES:
            goes_on = True
        elif inside.min() > ALTERNATES:
            return _dark_first(gray, board, points_px[upright_orders(board, points_px)[0]]), goes_on
    return None, goes_on


def _why_not(gray: ByteArray, board: Board, goes_on: bool) -> str:
    """Return what was seen instead of the board, and what to change."""
    size = chessboard_size(gray, board.columns >= board.rows)
    if size is not None:
        smaller = size[0] * size[1] < board.columns * board.rows
        first = "have the whole board in the picture, or " if smaller else ""
        return (
            f"A chessboard of {size[0]} x {size[1]} inner corners is seen, not of {board.columns} x "
            f"{board.rows}; {first}try --columns {size[0]} --rows {size[1]}"
        )
    if goes_on:
        return (
            f"The board has more inner corners than {board.columns} x {board.rows}; "
            "count its columns and rows"
        )
    others = dictionaries_in(gray, USUAL)
    seen = max(others, key=lambda one: len(one.ids), default=None)
    if seen is not None:
        pattern = "aprilgrid or charuco" if seen.dictionary == APRILGRID else "charuco"
        return f"No chessboard is seen, but {seen.title}; try --pattern {pattern}"
    return (
        f"No chessboard of {board.columns} x {board.rows} inner corners is seen; count the corners between "
        "four squares, and have the whole board with its white rim in the picture, sharp and evenly lit"
    )


def chessboard_size(gray: ByteArray, wide: bool) -> tuple[int, int] | None:
    """Return columns and rows of a whole chessboard of any size; None if none is seen.

    The larger number is preferred as columns if ``wide``, else as rows.
    """
    flags = cv2.CALIB_CB_LARGER | cv2.CALIB_CB_EXHAUSTIVE | cv2.CALIB_CB_NORMALIZE_IMAGE
    found, _, meta = cv2.findChessboardCornersSBWithMeta(gray, (LEAST_SIDE, LEAST_SIDE), flags)
    if not found or max(meta.shape) > MOST_POINTS:
        return None
    sides = sorted(meta.shape, reverse=wide)
    for columns, rows in (sides, sides[::-1]):
        if _found(gray, Board("chessboard", columns, rows))[0] is not None:
            return columns, rows
    return None


def _alternation(gray: ByteArray, board: Board, points_px: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return (4,) contrasts of alternating squares at the outermost rows and columns of corners, and (4,) at
    the rows and columns next outside, each over that at the next inside: 1 at corners, 0.5 at the rim.
    """
    grid = points_px.reshape(board.rows, board.columns, 2)
    for _ in range(2):  # extrapolate a row on either side; then, transposed, a column
        grid = np.concatenate([2 * grid[:1] - grid[1:2], grid, 2 * grid[-1:] - grid[-2:-1]]).swapaxes(0, 1)
    down, right = np.gradient(INTO_A_SQUARE * grid, axis=(0, 1))
    ways = (right + down, -right - down, right - down, down - right)
    squares_px = grid + np.stack(ways)
    one, opposite, left, below = brightness(gray, squares_px.reshape(-1, 2)).reshape(squares_px.shape[:3])
    crossing = one + opposite - left - below
    crossing[::2] *= -1.0
    crossing[:, ::2] *= -1.0
    crossing *= np.sign(crossing[1:-1, 1:-1].mean())
    rows, columns = crossing[:, 1:-1].mean(axis=1), crossing[1:-1].mean(axis=0)
    sides = np.array([side[:3] for line in (rows, columns) for side in (line, line[::-1])])
    outside, last, inner = np.maximum(sides, 1.0).T  # 510 for black and white
    return last / inner, outside / last


def _refined(gray: ByteArray, board: Board) -> tuple[bool, FloatArray | None]:
    flags = cv2.CALIB_CB_ADAPTIVE_THRESH | cv2.CALIB_CB_NORMALIZE_IMAGE
    found, corners = cv2.findChessboardCorners(gray, board.size, flags=flags)
    if not found:
        return False, None
    until = (cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_MAX_ITER, 40, 1e-3)
    return True, cv2.cornerSubPix(gray, corners, (CORNER_WINDOW_PX,) * 2, (-1, -1), until)


def _dark_first(gray: ByteArray, board: Board, points_px: FloatArray) -> Detection:
    """Order corners to have a black square between the first four; ambiguous boards keep their order."""
    square = [0, 1, board.columns, board.columns + 1]
    here, there = (
        float(brightness(gray, order[square].mean(axis=0)[None])[0]) for order in (points_px, points_px[::-1])
    )
    if not board.ambiguous and there < here:
        points_px = points_px[::-1]
    return whole(board, points_px, oriented=not board.ambiguous)
