"""Boards with markers of any dictionary, in either layout, are found; if not, the reason and its remedy are
true.
"""

import re
from dataclasses import replace

import cv2
import numpy as np
import pytest

from packetmesh.errors import InputError
from pipeline.calibration import aprilgrid
from pipeline.calibration.aprilgrid import tag_points
from pipeline.calibration.board import Board
from pipeline.calibration.detect import detect
from pipeline.calibration.dictionaries import FAMILIES, dictionary, known_dictionary
from pipeline.calibration.markers import Markers, fit
from tests.pipeline.calibration.views import CAMERA, photograph, poses, seen

PIXELS = 60
"""Pixels of a square in a picture by OpenCV."""


def drawn(board, name="5X5_1000", legacy=False, share=0.75):
    """(H, W) OpenCV's own picture of the board, and (N, 2) its corners there."""
    squares = board.columns + 1, board.rows + 1
    made = cv2.aruco.CharucoBoard(squares, 1.0, share, dictionary(name))
    made.setLegacyPattern(legacy)
    picture = made.generateImage((PIXELS * squares[0], PIXELS * squares[1]), marginSize=0)
    row, column = np.divmod(np.arange(board.columns * board.rows), board.columns)
    corners = PIXELS * np.column_stack([column + 1.0, row + 1.0]) - 0.5
    return cv2.copyMakeBorder(picture, 40, 40, 40, 40, cv2.BORDER_CONSTANT, value=255), corners + 40.0


def off_px(found, corners):
    assert found.found, found.reason
    return np.linalg.norm(found.points_px - corners[found.indices], axis=1)


@pytest.mark.parametrize("name", FAMILIES)
def test_the_dictionary_of_a_board_need_not_be_known(name):
    board = Board("charuco", 5, 4, 0.03)
    picture, corners = drawn(board, name)
    found = detect(picture, board)
    assert len(found.indices) == 20
    assert off_px(found, corners).max() < 0.5


@pytest.mark.parametrize("along_px", [(0.0, 0.0), (10.0, 0.0), (7.0, 7.0)])
def test_markers_at_one_place_or_on_one_line_fit_no_board(along_px):
    """No map from pixels to the board follows from them."""
    centres = np.stack(np.meshgrid(np.arange(3.0), np.arange(2.0)), axis=-1).reshape(-1, 2)
    centres_px = 50.0 + np.arange(6)[:, None] * np.array(along_px)
    square_px = np.array([[-2.0, -2.0], [2.0, -2.0], [2.0, 2.0], [-2.0, 2.0]])
    seen = Markers("4X4_50", np.arange(6), centres_px[:, None] + square_px)
    assert fit(seen, centres, 1.0) is None
    straight = Markers("4X4_50", np.arange(6), 50.0 + 10.0 * centres[:, None] + square_px)
    assert fit(straight, centres, 1.0).in_place.all()


@pytest.mark.parametrize("rows", [3, 4, 5])
@pytest.mark.parametrize("columns", [4, 5])
def test_the_layout_of_old_programs_is_found(columns, rows):
    """With an odd number of rows of squares (even rows of corners), both layouts are the same."""
    board = Board("charuco", columns, rows, 0.03)
    picture, corners = drawn(board, legacy=True)
    found = detect(picture, board)
    assert found.legacy is (rows % 2 == 1)
    assert len(found.indices) == columns * rows
    assert off_px(found, corners).max() < 0.5


@pytest.mark.parametrize("share", [0.5, 0.6, 0.75, 0.85])
def test_markers_may_have_another_share_of_the_squares(share):
    board = Board("charuco", 6, 4, 0.03)
    picture, corners = drawn(board, share=share)
    found = detect(picture, board)
    assert len(found.indices) == 24
    assert off_px(found, corners).max() < 0.5


def test_another_dictionary_is_named_and_naming_it_finds_the_board():
    picture, corners = drawn(Board("charuco", 5, 4, 0.03), "6X6_250")
    refused = detect(picture, Board("charuco", 5, 4, 0.03, "4X4_50"))
    assert (
        "No markers of 4X4_50 are seen, but 15 markers of the dictionary 6X6_1000 (numbers 0 to 14)"
        in refused.reason
    )
    name = re.search(r"--dictionary (\S+)", refused.reason)[1]
    assert off_px(detect(picture, Board("charuco", 5, 4, 0.03, name)), corners).max() < 0.5


@pytest.mark.parametrize("asked", [(4, 4), (7, 4), (6, 5), (9, 6)])
def test_a_board_of_another_size_is_named_and_that_size_finds_it(asked):
    picture, corners = drawn(Board("charuco", 5, 4, 0.03))
    refused = detect(picture, Board("charuco", *asked, 0.03))
    if refused.found:  # the same columns: a part of the board
        assert asked[0] == 5
        return
    columns, rows = map(int, re.search(r"--columns (\d+) --rows (\d+)", refused.reason).groups())
    assert (columns, rows) == (5, 4)
    assert off_px(detect(picture, Board("charuco", columns, rows, 0.03)), corners).max() < 0.5


def test_too_few_corners_ask_for_more_of_the_board_which_finds_it():
    board = Board("charuco", 6, 5, 0.03)
    picture, corners = drawn(board)
    part = picture[:, : 40 + int(1.95 * PIXELS)]
    refused = detect(part, board)
    assert "corners between them, and it takes 6; have more of the board" in refused.reason
    more = detect(picture[:, : 40 + int(3.5 * PIXELS)], board)
    assert off_px(more, corners).max() < 0.5


def test_no_marker_at_all_says_so():
    reason = detect(np.full((240, 320), 200, np.uint8), Board("charuco", 5, 4, 0.03)).reason
    assert "No markers of any dictionary that OpenCV knows are seen" in reason
    assert (
        "dictionary" not in detect(np.full((240, 320), 200, np.uint8), Board("aprilgrid", 4, 3, 0.05)).reason
    )


def test_markers_that_only_a_large_dictionary_has_are_named():
    """A board with these numbers has more markers than the dictionary of our own boards."""
    picture = np.full((400, 400), 255, np.uint8)
    for place, number in enumerate((990, 1000, 1010, 1020)):
        y, x = 50 + 180 * (place // 2), 50 + 180 * (place % 2)
        marker = cv2.aruco.generateImageMarker(dictionary("APRILTAG_36H10"), number, 120)
        picture[y : y + 120, x : x + 120] = marker
    found = detect(picture, Board("charuco", 5, 4, 0.03))
    assert not found.found
    assert "4 markers of the dictionary APRILTAG_36H10 (numbers 990 to 1020) are seen" in found.reason


@pytest.mark.parametrize("name", ["DICT_APRILTAG_36h11", "apriltag_36h11", "APRILTAG_36H11"])
def test_a_dictionary_has_one_name_in_any_spelling(name):
    assert known_dictionary(name) == "APRILTAG_36H11"
    assert Board("charuco", 5, 4, 0.03, name) == Board("charuco", 5, 4, 0.03, "APRILTAG_36H11")


@pytest.mark.parametrize(
    ("given", "sentence"),
    [
        (("charuco", 5, 4, 0.03, "9X9_50"), "no dictionary '9X9_50'; try one of OpenCV's, such as 4X4_50"),
        (("charuco", 12, 9, 0.03, "4X4_50"), "has 65 markers, and the dictionary 4X4_50 has 50"),
        (
            ("charuco", 50, 50, 0.03),
            "1300 markers, and the dictionary 5X5_1000 has 1000; try fewer columns or rows",
        ),
        (
            ("aprilgrid", 30, 30, 0.03),
            "has 900 markers, and the dictionary APRILTAG_36H11 has 587; try fewer",
        ),
        (("circles", 5, 4, 0.03, "4X4_50"), "pattern circles has no dictionary"),
        (("aprilgrid", 6, 6, 0.03, "", 0.0), "tag spacing of 0 cannot be used"),
        (("aprilgrid", 6, 6, 0.03, "", 1.5), "tag spacing of 1.5 cannot be used"),
    ],
)
def test_boards_that_no_dictionary_holds_are_refused(given, sentence):
    with pytest.raises(InputError, match=re.escape(sentence)):
        Board(*given)


# AprilGrid.

GRID = Board("aprilgrid", 5, 4, 0.05)


def test_tags_are_numbered_from_the_lower_left_as_kalibr_does():
    """Kalibr: x to the right, y up, tag 0 at the origin, tag pitch 1.3 sides."""
    first = GRID.points_m[tag_points(GRID)]
    lower_left = first[0, 3] * (1.0, -1.0, 1.0)
    kalibr = (first * (1.0, -1.0, 1.0) - lower_left)[:, [3, 2, 1, 0]]
    np.testing.assert_allclose(
        kalibr[0], 0.05 * np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]), atol=1e-12
    )
    np.testing.assert_allclose(kalibr[1, 0], (0.065, 0.0, 0.0), atol=1e-12)
    np.testing.assert_allclose(kalibr[5, 0], (0.0, 0.065, 0.0), atol=1e-12)


@pytest.mark.parametrize("turn_deg", [0.0, 60.0, 180.0])
def test_the_corners_of_tags_are_found_where_they_are(turn_deg):
    for T in poses(GRID, 4, turn_deg):
        found = detect(photograph(GRID, T), GRID)
        assert len(found.indices) >= 0.9 * len(GRID.points_m)
        assert off_px(found, seen(GRID, T)).max() < 0.35


def test_tags_without_squares_at_their_corners_numbered_from_the_upper_left_are_found():
    """OpenCV's own grid board: one cell of border, nothing between the tags, the other way up."""
    board = Board("aprilgrid", 4, 3, 0.05, tag_spacing=0.25)
    made = cv2.aruco.GridBoard((4, 3), 0.05, 0.0125, dictionary("APRILTAG_36H11"))
    picture = made.generateImage((950, 700), marginSize=0)
    picture = cv2.copyMakeBorder(picture, 40, 40, 40, 40, cv2.BORDER_CONSTANT, value=255)
    found = detect(picture, board)
    size_m = np.ptp(board.points_m[:, :2], axis=0)
    scale = 950 / size_m[0]
    at_px = (board.points_m[:, :2] + 0.5 * size_m) * scale + 39.5
    assert len(found.indices) == 48
    assert np.abs(found.points_px - at_px[found.indices]).max() < 2.5


@pytest.mark.parametrize("asked", [(4, 4), (7, 5), (6, 4)])
def test_a_grid_of_another_size_is_not_found(asked):
    refused = detect(photograph(GRID, poses(GRID)[0]), Board("aprilgrid", *asked, 0.05))
    assert not refused.found
    assert "20 markers of the dictionary APRILTAG_36H11 (numbers 0 to 19) are seen" in refused.reason
    assert "check --columns, --rows" in refused.reason


def test_an_aprilgrid_asked_for_as_charuco_and_the_other_way_round_names_what_is_seen():
    picture, _ = drawn(Board("charuco", 5, 4, 0.03))
    reason = detect(picture, GRID).reason
    assert "15 markers of the dictionary 5X5_1000 (numbers 0 to 14); try --pattern charuco" in reason


def test_tags_without_usable_corners_say_why_they_are_not_used(monkeypatch):
    monkeypatch.setattr(aprilgrid, "WRONG", -1.0)  # nothing is as close to its prediction
    refused = detect(photograph(GRID, poses(GRID)[0]), GRID)
    assert not refused.found
    assert (
        "are seen, but only 0 of their corners where the tags around predict them, and it" in refused.reason
    )


def test_a_camera_is_calibrated_by_an_aprilgrid():
    from pipeline.calibration.estimate import View, calibrate

    views = []
    for index, T in enumerate(poses(GRID, 6)):
        found = detect(photograph(GRID, T), GRID)
        views.append(View(str(index), found.points_px, GRID.points_m[found.indices]))
    camera = calibrate(views, (640, 480))
    assert camera.matrix[0, 0] == pytest.approx(CAMERA.fx_px, rel=0.005)
    assert camera.rms_px < 0.15


@pytest.mark.parametrize("board", [Board("charuco", 6, 4, 0.03), Board("aprilgrid", 5, 4, 0.05)])
def test_mirror_images_and_negatives_are_named(board):
    picture = photograph(board, poses(board, 2)[1])
    for changed, says in (
        (picture[:, ::-1], "as mirror images; turn off"),
        (255 - picture, "white on black"),
    ):
        found = detect(np.ascontiguousarray(changed), board)
        assert not found.found
        assert says in found.reason


@pytest.mark.parametrize("given", [0.1, 0.2, 0.4, 0.9])
def test_a_wrong_tag_spacing_is_refused_with_the_right_one(given):
    board = Board("aprilgrid", 5, 4, 0.05, tag_spacing=0.3)
    for T in poses(board, 4):
        found = detect(photograph(board, T), replace(board, tag_spacing=given))
        assert not found.found
        told = float(re.search(r"try --tag-spacing ([\d.]+),", found.reason)[1])
        assert told == pytest.approx(0.3, abs=0.03)
        assert detect(photograph(board, T), replace(board, tag_spacing=told)).found


def test_an_aprilgrid_is_not_taken_for_a_charuco_board():
    picture = photograph(Board("aprilgrid", 5, 4, 0.05), poses(Board("aprilgrid", 5, 4, 0.05), 2)[1])
    for dictionary_name in ("", "4X4_50", "APRILTAG_36H11"):
        found = detect(picture, Board("charuco", 5, 4, 0.05, dictionary_name))
        assert not found.found
        assert "try --pattern aprilgrid" in found.reason


def test_tags_predicted_outside_of_the_image_are_no_error():
    board = Board("aprilgrid", 5, 4, 0.05)
    for shift in (0.3, 0.4, 0.5, 0.6):
        T = poses(board, 2)[1].copy()
        T[0, 3] += shift * np.ptp(board.points_m[:, 0])
        found = detect(photograph(board, T), replace(board, tag_spacing=0.27))
        if found.found:
            assert ((found.points_px >= 0.0) & (found.points_px < (CAMERA.width_px, CAMERA.height_px))).all()
