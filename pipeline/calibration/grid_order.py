"""Order of a grid's points: the orders that are possible for a detected grid, and the tests that choose."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from pipeline.calibration.board import Board
from pipeline.types import FloatArray, IntArray

MOST_BEND = 0.5
"""Largest change of the step between neighbours along a row or column, as a share of the step."""


def upright_orders(board: Board, points_px: FloatArray) -> list[IntArray]:
    """Return the orders in which detected points match the board: not mirrored, shifted rows in their places.

    ``cv2.findCirclesGrid`` returns an even number of shifted rows with neighbouring rows exchanged, and may
    return any grid rotated, mirrored or transposed.

    Args:
        board: a board of circles or a chessboard.
        points_px: (N, 2) all points of the board, row by row in the detector's order.
    """
    return [
        order
        for order in _orders(board)
        if _right_handed(points_px[order], board) and _interleaved(points_px[order], board)
    ]


def even_steps(points_px: FloatArray, board: Board) -> bool:
    """Return whether every point is near the place that two neighbours in its row or column predict."""
    grid = points_px.reshape(board.rows, board.columns, 2)
    alike = 2 if board.pattern == "circles-asymmetric" else 1  # every second row is shifted
    for lines in (grid, *(grid[first::alike].swapaxes(0, 1) for first in range(alike))):
        steps = np.diff(lines, axis=1)
        pitch_px = np.linalg.norm(steps, axis=2)
        bend_px = np.linalg.norm(np.diff(steps, axis=1), axis=2)
        if (bend_px > MOST_BEND * np.minimum(pitch_px[:, 1:], pitch_px[:, :-1])).any():
            return False
    return True


def _orders(board: Board) -> Iterator[IntArray]:
    """Yield orders of a grid: unchanged, rotated by 180°, mirrored, and transposed if its outline is square;
    shifted rows also with neighbouring rows exchanged.
    """
    shifted = board.pattern == "circles-asymmetric"
    grid: IntArray = np.arange(board.columns * board.rows).reshape(board.rows, board.columns)
    grids = [grid]
    if shifted and board.rows % 2 == 0:
        grids.append(grid.reshape(-1, 2, board.columns)[:, ::-1].reshape(grid.shape))
    if shifted and board.rows == 2 * board.columns:
        grids += [_transposed_shifted(one) for one in grids]
    elif not shifted and board.columns == board.rows:
        grids.append(grid.T)
    for one in grids:
        for down, right in ((1, 1), (-1, -1), (1, -1), (-1, 1)):
            yield one[::down, ::right].ravel()


def _transposed_shifted(grid: IntArray) -> IntArray:
    """Return a (2 C, C) grid of shifted rows mirrored at its diagonal, which such a grid maps onto itself."""
    row, column = np.divmod(np.arange(grid.size), grid.shape[1])
    x = 2 * column + row % 2
    return grid[x, row // 2].reshape(grid.shape)


def _right_handed(points_px: FloatArray, board: Board) -> bool:
    """Return whether the grid is not mirrored: in the image the way down its columns is clockwise of the way
    along its rows.
    """
    first, last = points_px[0], points_px[-1]
    right, down = points_px[board.columns - 1] - first, points_px[-board.columns] - first
    turned = (right[0] * down[1] - right[1] * down[0]) > 0.0
    opposite = (last - points_px[-board.columns]) @ right > 0.0
    return bool(turned and opposite)


def _interleaved(points_px: FloatArray, board: Board) -> bool:
    """Return whether each point of a shifted row is near the mean of its four neighbours in the rows above
    and below: within ``MOST_BEND`` times its mean distance from them. True for rows that are not shifted.
    """
    if board.pattern != "circles-asymmetric":
        return True
    grid = points_px.reshape(board.rows, board.columns, 2)
    for row in range(1, board.rows - 1):
        own = grid[row, :-1] if row % 2 else grid[row, 1:]
        around = np.stack([grid[row - 1, :-1], grid[row - 1, 1:], grid[row + 1, :-1], grid[row + 1, 1:]])
        off_px = np.linalg.norm(own - around.mean(axis=0), axis=1)
        if (off_px > MOST_BEND * np.linalg.norm(own - around, axis=2).mean(axis=0)).any():
            return False
    return True
