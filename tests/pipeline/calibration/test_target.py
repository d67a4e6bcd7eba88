"""What is printed is as large as it says."""

import re

import cv2
import numpy as np
import pytest

from packetmesh.errors import InputError
from pipeline.calibration.board import Board
from pipeline.calibration.detect import detect
from pipeline.calibration.target import MARGIN_MM, Box, Disc, picture_of, sheet, write_target

BOARDS = [
    Board(),
    Board("circles-asymmetric", 4, 11, 0.02),
    Board("chessboard", 9, 6),
    Board("charuco", 7, 5),
]


@pytest.mark.parametrize("board", BOARDS[:2])
def test_an_svg_has_its_circles_where_the_points_are_in_millimetres(board, tmp_path):
    write_target(board, tmp_path / "board.svg")
    text = (tmp_path / "board.svg").read_text()
    circles = np.array(
        re.findall(r'<circle cx="([\d.]+)" cy="([\d.]+)" r="([\d.]+)" fill="#000"', text), float
    )
    printed_mm = circles[: len(board.points_m), :2]
    wanted_mm = 1000.0 * board.points_m[:, :2]
    np.testing.assert_allclose(printed_mm - printed_mm[0], wanted_mm - wanted_mm[0], atol=2e-4)
    width, box = re.search(r'width="([\d.]+)mm".*viewBox="0 0 ([\d.]+)', text).groups()
    assert width == box


def test_a_pdf_page_is_as_large_as_the_sheet_and_the_same_every_time(tmp_path):
    write_target(Board(), tmp_path / "board.pdf")
    content = (tmp_path / "board.pdf").read_bytes()
    box = re.search(rb"/MediaBox \[ 0 0 ([\d.]+) ([\d.]+) \]", content)
    whole = sheet(Board())
    points = [float(value) for value in box.groups()]
    assert points == pytest.approx([whole.width_mm / 25.4 * 72, whole.height_mm / 25.4 * 72], abs=0.01)
    write_target(Board(), tmp_path / "again.pdf")
    assert (tmp_path / "again.pdf").read_bytes() == content


def test_the_mark_is_in_the_first_circle_only_and_only_where_it_is_needed():
    white = [shape for shape in sheet(BOARDS[0]).shapes if isinstance(shape, Disc) and not shape.black]
    first = next(shape for shape in sheet(BOARDS[0]).shapes if isinstance(shape, Disc))
    assert [(one.x_mm, one.y_mm) for one in white] == [(first.x_mm, first.y_mm)]
    assert all(shape.black for shape in sheet(BOARDS[1]).shapes if isinstance(shape, Disc))


@pytest.mark.parametrize("board", [*BOARDS, Board("chessboard", 3, 4, 0.005)])
def test_board_and_ruler_keep_the_margin_from_the_sheet_s_sides(board):
    whole = sheet(board)
    ends_mm = [
        (one.x_mm - one.radius_mm, one.x_mm + one.radius_mm)
        if isinstance(one, Disc)
        else (one.x_mm, one.x_mm + one.width_mm)
        for one in whole.shapes
        if isinstance(one, Disc | Box)
    ]
    left_mm, right_mm = np.min(ends_mm), np.max(ends_mm)
    assert left_mm >= MARGIN_MM - 0.2
    assert right_mm <= whole.width_mm - MARGIN_MM + 0.2


def test_charuco_squares_and_markers_are_opencvs(tmp_path):
    board = BOARDS[3]
    pixel_mm = 1000.0 * board.spacing_m / 80.0
    ours = picture_of(sheet(board), pixel_mm)
    theirs = board.charuco().generateImage((8 * 80, 6 * 80), marginSize=0)
    best = cv2.matchTemplate(ours, theirs, cv2.TM_CCOEFF_NORMED).max()
    assert best > 0.97


@pytest.mark.parametrize("board", BOARDS)
def test_on_a_monitor_all_pitches_are_whole_pixels(board, tmp_path):
    shown = write_target(board, tmp_path / "board.png", pixel_mm=0.3)
    assert (1000.0 * shown.spacing_m / 0.3) == pytest.approx(round(1000.0 * shown.spacing_m / 0.3))
    assert abs(shown.spacing_m - board.spacing_m) <= 0.15e-3 + 1e-9
    picture = cv2.imread(str(tmp_path / "board.png"), cv2.IMREAD_GRAYSCALE)
    assert picture.shape == picture_of(sheet(shown), 0.3).shape


@pytest.mark.parametrize("pixel_mm", [0.277, 0.4])
@pytest.mark.parametrize(
    "board",
    [Board("chessboard", 9, 6, 0.0348), Board("charuco", 7, 5, 0.0348), Board("aprilgrid", 6, 6)],
    ids=lambda board: board.pattern,
)
def test_on_a_monitor_corners_are_where_the_returned_board_has_them(board, pixel_mm, tmp_path):
    """The margin of 15 mm is 37.5 pixels of 0.4 mm, and a gap of 0.3 tags 37.8 pixels of 0.277 mm."""
    shown = write_target(board, tmp_path / "board.png", pixel_mm)
    found = detect(cv2.imread(str(tmp_path / "board.png"), cv2.IMREAD_GRAYSCALE), shown)
    assert len(found.indices) == len(shown.points_m)
    off_mm = pixel_mm * found.points_px - 1000.0 * shown.points_m[found.indices, :2]
    np.testing.assert_allclose(off_mm - off_mm.mean(axis=0), 0.0, atol=0.02)


@pytest.mark.parametrize(
    ("name", "pixel_mm", "sentence"),
    [
        ("board.jpg", None, r"try \.pdf, \.svg or \.png"),
        ("board.png", None, "size of its pixels"),
        ("board.png", 99.0, "pixels"),
    ],
)
def test_what_cannot_be_written_is_told_and_leaves_no_file(name, pixel_mm, sentence, tmp_path):
    with pytest.raises(InputError, match=sentence):
        write_target(Board(), tmp_path / name, pixel_mm)
    assert not list(tmp_path.iterdir())
