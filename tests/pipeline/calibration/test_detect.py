"""Boards are found where they are, never mirrored, and where they are not it says why."""

import re

import cv2
import numpy as np
import pytest

from packetmesh.errors import InputError
from pipeline.calibration import chessboard
from pipeline.calibration.board import Board
from pipeline.calibration.circles import _grid_name
from pipeline.calibration.detect import detect
from tests.pipeline.calibration.views import photograph, poses, seen

BOARDS = {
    "thesis": Board(),
    "square": Board("circles", 6, 6, 0.03),
    "shifted": Board("circles-asymmetric", 4, 11, 0.02),
    "even shifted": Board("circles-asymmetric", 4, 10, 0.018),
    "chessboard": Board("chessboard", 9, 6, 0.025),
    "charuco": Board("charuco", 8, 5, 0.03),
    "tags": Board("aprilgrid", 5, 4, 0.05),
}


@pytest.fixture(scope="module", params=BOARDS)
def board(request):
    return BOARDS[request.param]


@pytest.mark.parametrize("turn_deg", [7.0, 60.0])
def test_points_are_found_where_they_are_in_the_boards_own_order(board, turn_deg):
    for T in poses(board, 4, turn_deg):
        found = detect(photograph(board, T), board)
        assert found.found, found.reason
        assert found.oriented
        off_px = np.linalg.norm(found.points_px - seen(board, T)[found.indices], axis=1)
        assert off_px.max() < 0.5
        assert np.mean(off_px) < 0.15


def test_without_its_mark_a_grid_may_be_upside_down_and_says_so_but_is_never_mirrored():
    board = BOARDS["thesis"]
    T = poses(board)[1]
    picture = photograph(board, T)
    x, y = seen(board, T)[0].round().astype(int).tolist()
    cv2.circle(picture, (x, y), 6, int(picture[y, x]), -1)
    found = detect(picture, board)
    assert found.found
    assert not found.oriented
    right = found.points_px[1] - found.points_px[0]
    down = found.points_px[board.columns] - found.points_px[0]
    assert right[0] * down[1] - right[1] * down[0] > 0.0


def test_light_circles_on_dark_paper_are_found_too():
    board = BOARDS["thesis"]
    T = poses(board)[2]
    found = detect(255 - photograph(board, T), board)
    assert found.found
    assert np.linalg.norm(found.points_px - seen(board, T), axis=1).max() < 0.5


def test_a_board_cut_off_by_the_rim_says_how_much_of_it_is_seen():
    board = BOARDS["thesis"]
    T = poses(board)[0].copy()
    T[0, 3] += 0.8 * np.ptp(board.points_m[:, 0])
    found = detect(photograph(board, T), board)
    assert not found.found
    assert "of 99 circles are seen" in found.reason
    assert 20 < len(found.blobs_px) < 99


@pytest.mark.parametrize("size", [(10, 9), (11, 8), (7, 5), (12, 9), (11, 10)])
def test_a_grid_of_another_size_is_not_found_in_a_part_of_the_board(size):
    for T in poses(BOARDS["thesis"], 4):
        found = detect(photograph(BOARDS["thesis"], T), Board("circles", *size, 0.035))
        assert not found.found
        assert "--columns 11 --rows 9" in found.reason or "--columns and --rows" in found.reason


@pytest.mark.parametrize("name", ["shifted", "even shifted", "chessboard", "charuco", "tags"])
def test_other_boards_of_another_size_are_not_found_either(name):
    board = BOARDS[name]
    other = Board(board.pattern, board.columns - 1, board.rows - 2, board.spacing_m)
    assert not detect(photograph(board, poses(board)[1]), other).found


@pytest.mark.parametrize("size", [(8, 4), (7, 4), (9, 5), (8, 6), (10, 6), (10, 7)])
def test_a_chessboard_of_another_size_is_not_found_whatever_the_detectors_draw(size, monkeypatch):
    """OpenCV's detectors draw at random, and find a part of a board, or its rim, now and then.

    Why it is not found is long looked for, and asked below.
    """
    monkeypatch.setattr(chessboard, "_why_not", lambda *_: "of another size")
    board = BOARDS["chessboard"]
    for seed, T in enumerate(poses(board)):
        cv2.setRNGSeed(seed)
        assert not detect(photograph(board, T), Board("chessboard", *size, board.spacing_m)).found


@pytest.mark.parametrize("board", [BOARDS["thesis"], BOARDS["chessboard"], BOARDS["charuco"]])
def test_a_picture_of_something_else_has_no_board(board):
    noise = np.random.default_rng(0).integers(0, 255, (240, 320), np.uint8)
    for picture in (np.full((240, 320, 3), 128, np.uint8), noise):
        found = detect(picture, board)
        assert not found.found
        assert found.reason


def test_only_eight_bits_are_searched():
    with pytest.raises(InputError, match="try 8 bits"):
        detect(np.zeros((4, 4), np.uint16), Board())


@pytest.mark.parametrize(
    ("given", "sentence"),
    [
        (("rings",), "no pattern 'rings'"),
        (("circles", 1), "1 columns"),
        (("circles", 11, 99), "99 rows"),
        (("circles", 11, 9, 0.0), "spacing of 0 m"),
    ],
)
def test_boards_that_cannot_be_are_refused(given, sentence):
    with pytest.raises(InputError, match=sentence):
        Board(*given)


@pytest.mark.parametrize("size", [(8, 6), (9, 5), (7, 7), (10, 7), (6, 9)])
def test_a_chessboard_of_another_size_is_named_and_that_size_finds_it(size):
    picture = photograph(BOARDS["chessboard"], poses(BOARDS["chessboard"])[1])
    refused = detect(picture, Board("chessboard", *size, 0.025))
    if size == (6, 9):  # the same board, columns and rows exchanged
        assert refused.found
        return
    columns, rows = map(int, re.search(r"--columns (\d+) --rows (\d+)", refused.reason).groups())
    assert {columns, rows} == {9, 6}
    assert detect(picture, Board("chessboard", columns, rows, 0.025)).found


@pytest.mark.parametrize(("name", "pattern"), [("charuco", "charuco"), ("tags", "aprilgrid")])
def test_markers_in_place_of_a_chessboard_are_named_and_their_pattern_finds_them(name, pattern):
    board = BOARDS[name]
    picture = photograph(board, poses(board)[1])
    refused = detect(picture, Board("chessboard", 9, 6, 0.025))
    assert f"--pattern {pattern}" in refused.reason
    assert detect(picture, board).found


@pytest.mark.parametrize(
    ("name", "asked"),
    [
        ("shifted", Board("circles", 4, 11, 0.02)),
        ("thesis", Board("circles-asymmetric", 11, 9, 0.02)),
        ("even shifted", Board("circles-asymmetric", 4, 11, 0.018)),
        ("even shifted", Board("circles-asymmetric", 5, 10, 0.018)),
        ("even shifted", Board("circles-asymmetric", 4, 8, 0.018)),
        ("even shifted", Board("circles-asymmetric", 3, 10, 0.018)),
        ("shifted", Board("circles-asymmetric", 4, 10, 0.02)),
        ("shifted", Board("circles-asymmetric", 4, 9, 0.02)),
    ],
)
def test_circles_in_other_rows_are_not_found_and_the_options_to_check_are_named(name, asked):
    for T in poses(BOARDS[name], 4):
        refused = detect(photograph(BOARDS[name], T), asked)
        assert not refused.found
        right = f"--columns {BOARDS[name].columns} --rows {BOARDS[name].rows}"
        assert right in refused.reason or "--columns and --rows" in refused.reason


def test_an_even_number_of_shifted_rows_without_its_mark_may_be_upside_down_and_says_so():
    board = BOARDS["even shifted"]
    T = poses(board)[1]
    picture = photograph(board, T)
    x, y = seen(board, T)[0].round().astype(int).tolist()
    cv2.circle(picture, (x, y), 8, int(picture[y, x]), -1)
    found = detect(picture, board)
    assert found.found
    assert not found.oriented
    truth = seen(board, T)
    assert min(np.abs(found.points_px - one).max() for one in (truth, truth[::-1])) < 0.5


def test_the_rows_of_a_grid_are_named():
    """As in: 4 x 11 circles in shifted rows are seen, not ..."""
    assert _grid_name(Board("circles-asymmetric", 4, 11, 0.02)) == "4 x 11 circles in shifted rows"
    assert _grid_name(Board("circles", 4, 11, 0.02)) == "4 x 11 circles in straight rows"


def test_more_circles_than_the_board_has_are_not_called_some_of_them():
    """Dots in no rows: all are counted, and none is said to be missing."""
    rng = np.random.default_rng(3)
    gray = np.full((480, 640), 235, np.uint8)
    grid = np.stack(np.meshgrid(np.arange(30, 610, 48), np.arange(30, 460, 44)), axis=-1).reshape(-1, 2)
    for x, y in (grid + rng.uniform(-14.0, 14.0, grid.shape)).astype(int).tolist():
        cv2.circle(gray, (x, y), 8, 20, -1, cv2.LINE_AA)
    found = detect(gray, BOARDS["thesis"])
    assert not found.found
    assert len(found.blobs_px) > 99
    assert (
        f"{len(found.blobs_px)} circles are seen, but no straight rows of 11 x 9 among them" in found.reason
    )
