"""Grids of circles found by growing a lattice, and the boards that are named in refusals."""

import cv2
import numpy as np
import pytest

from pipeline.calibration.board import Board
from pipeline.calibration.circle_lattice import board_seen, orders_on
from pipeline.calibration.detect import detect
from tests.pipeline.calibration.views import CAMERA, photograph, poses, seen

BOARDS = [
    *(Board("circles-asymmetric", *size) for size in ((4, 11), (11, 4), (4, 10), (10, 4), (5, 8), (7, 9))),
    *(Board("circles", *size) for size in ((11, 9), (7, 7), (9, 3), (3, 9))),
]
TILTS_DEG = ((0, 0), (45, 10), (-45, 20), (12, 50), (30, -45))


def shuffled(board, x_deg, y_deg, roll_deg, seed=0):
    """(N, 2) centres in random order, and the place of each on the board."""
    T = poses(board, 1)[0]
    T[:3, :3] = cv2.Rodrigues(np.radians([0.0, 0.0, roll_deg]))[0]
    T[:3, :3] @= cv2.Rodrigues(np.radians([x_deg, y_deg, 0.0]))[0]
    points_px = seen(board, T)
    order = np.random.default_rng(seed).permutation(len(points_px))
    return points_px[order], order


@pytest.mark.parametrize("board", BOARDS, ids=lambda board: board.title)
@pytest.mark.parametrize("tilt", TILTS_DEG)
@pytest.mark.parametrize("roll_deg", [0.0, 37.0, 90.0, -120.0])
def test_every_grid_is_put_in_its_order_at_any_tilt_and_roll(board, tilt, roll_deg):
    blobs_px, order = shuffled(board, *tilt, roll_deg)
    true = np.argsort(order)
    orders = orders_on(board, blobs_px)
    assert any((one == true).all() for one in orders)
    turned = {tuple(one.tolist()) for one in orders}
    square = board.pattern == "circles" and board.columns == board.rows
    assert len(turned) == (4 if square else 2 if board.ambiguous else 1)


@pytest.mark.parametrize("board", BOARDS, ids=lambda board: board.title)
def test_the_board_that_is_seen_is_named_whatever_was_expected(board):
    blobs_px, _ = shuffled(board, 20, -15, 10.0)
    wide = board.columns >= board.rows
    for pattern in ("circles", "circles-asymmetric"):
        found = board_seen(blobs_px, Board(pattern, *((20, 19) if wide else (19, 20))))
        assert (found.pattern, found.size) == (board.pattern, board.size)


def test_blobs_that_are_no_whole_grid_are_no_board():
    board = BOARDS[0]
    blobs_px, _ = shuffled(board, 20, -15, 10.0)
    assert board_seen(blobs_px[1:], board) is None
    assert orders_on(board, blobs_px[1:]) == []
    beside = np.vstack([blobs_px, [[5.0, 5.0]]])
    assert board_seen(beside, board).size == board.size  # a letter does not hide the board
    rng = np.random.default_rng(3)
    assert board_seen(rng.uniform(0.0, CAMERA.width_px, (44, 2)), board) is None


@pytest.mark.parametrize(
    ("printed", "given"),
    [
        (Board("circles-asymmetric", 4, 11, 0.02), Board("circles-asymmetric", 11, 4, 0.02)),
        (Board("circles-asymmetric", 4, 11, 0.02), Board("circles", 4, 11, 0.02)),
        (Board("circles-asymmetric", 4, 11, 0.02), Board("circles-asymmetric", 8, 11, 0.02)),
        (Board("circles", 9, 7, 0.02), Board("circles-asymmetric", 9, 7, 0.02)),
        (Board("circles", 9, 7, 0.02), Board("circles", 10, 7, 0.02)),
        (Board("circles", 9, 7, 0.02), Board("circles", 8, 7, 0.02)),
    ],
    ids=lambda board: board.title,
)
def test_a_refusal_names_the_board_that_is_seen_and_it_is_found(printed, given):
    picture = photograph(printed, poses(printed, 2)[1])
    found = detect(picture, given)
    assert not found.found
    remedy = f"--columns {printed.columns} --rows {printed.rows}"
    if printed.pattern != given.pattern:
        remedy = f"--pattern {printed.pattern} {remedy}"
    assert remedy in found.reason
    assert detect(picture, printed).found
