"""Whatever order a detector returns a grid in, it is brought into the board's own."""

import numpy as np
import pytest

from pipeline.calibration.board import Board
from pipeline.calibration.grid_order import even_steps, upright_orders
from tests.pipeline.calibration.views import poses, seen


def flips(grid):
    return [grid[::down, ::right] for down in (1, -1) for right in (1, -1)]


def exchanged(grid):
    """Neighbouring rows exchanged, as OpenCV returns an even number of shifted rows."""
    return grid.reshape(-1, 2, *grid.shape[1:])[:, ::-1].reshape(grid.shape)


@pytest.mark.parametrize("size", [(4, 10), (4, 8), (5, 6), (4, 11), (3, 4), (4, 2)])
def test_shifted_rows_in_any_order_of_the_detector_are_put_right(size):
    board = Board("circles-asymmetric", *size, 0.02)
    right = np.arange(board.columns * board.rows).reshape(board.rows, board.columns)
    given = flips(right) + (flips(exchanged(right)) if board.rows % 2 == 0 else [])
    for T in poses(board, 4, 60.0):
        points_px = seen(board, T)
        for order in given:
            mixed = points_px[order.ravel()]
            found = [mixed[one] for one in upright_orders(board, mixed)]
            assert found
            allowed = [points_px, points_px[::-1]] if board.ambiguous else [points_px]
            for one in found:
                assert any(np.array_equal(one, other) for other in allowed)


def test_a_grid_of_shifted_rows_that_is_its_own_mirror_image_is_not_mirrored():
    """4 x 8: mirrored at its diagonal, it is the same grid, with columns where rows were."""
    board = Board("circles-asymmetric", 4, 8, 0.02)
    points_px = seen(board, poses(board)[1])
    row, column = np.divmod(np.arange(32), 4)
    x = 2 * column + row % 2
    mirrored = points_px[4 * x + row // 2]
    orders = upright_orders(board, mirrored)
    assert orders
    assert any(np.array_equal(mirrored[one], points_px) for one in orders)


def test_rows_in_no_order_at_all_are_no_grid():
    board = Board("circles-asymmetric", 4, 10, 0.02)
    points_px = seen(board, poses(board)[1]).reshape(10, 4, 2)
    assert not upright_orders(board, points_px[[0, 1, 2, 3, 5, 4, 6, 7, 8, 9]].reshape(-1, 2))


def test_exchanged_rows_look_even_along_rows_and_columns():
    """That is why the steps alone cannot show that rows are exchanged."""
    board = Board("circles-asymmetric", 4, 10, 0.02)
    grid = np.arange(40).reshape(10, 4)
    assert even_steps(seen(board, poses(board)[1])[exchanged(grid).ravel()], board)


@pytest.mark.parametrize(
    ("board", "ambiguous"),
    [
        (Board("circles-asymmetric", 4, 10), True),
        (Board("circles-asymmetric", 4, 11), False),
        (Board("circles-asymmetric", 3, 2), True),
        (Board("chessboard", 9, 6), False),
        (Board("chessboard", 8, 6), True),
        (Board("charuco", 8, 6), False),
        (Board("aprilgrid", 6, 6), False),
        (Board(), True),
    ],
)
def test_a_board_is_ambiguous_if_its_points_are_the_same_upside_down(board, ambiguous):
    """A chessboard's points always are; its black squares are not if columns and rows differ by an odd
    number.
    """
    assert board.ambiguous is ambiguous
    turned = -board.points_m
    same = all(np.abs(board.points_m - point).sum(axis=1).min() < 1e-9 for point in turned)
    if board.pattern.startswith("circles"):
        assert same is ambiguous
