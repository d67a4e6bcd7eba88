"""Files of images: which are meant, how they are named, and a camera from few of them."""

from pathlib import Path

import cv2
import numpy as np
import pytest

from packetmesh.progress import Progress, drain
from pipeline.calibration.board import Board
from pipeline.calibration.from_images import image_files, iterate_calibration, paths_by_name
from tests.pipeline.calibration.views import photograph, poses

BOARD = Board("chessboard", 5, 4, 0.05)


def test_a_name_with_brackets_is_a_file_if_it_exists_and_else_a_pattern(tmp_path):
    for name in ("photo[1].png", "photo1.png", "photo2.png"):
        cv2.imwrite(str(tmp_path / name), np.zeros((4, 4), np.uint8))
    assert image_files([str(tmp_path / "photo[1].png")]) == [tmp_path / "photo[1].png"]
    assert image_files([str(tmp_path / "photo[12].png")]) == [
        tmp_path / "photo1.png",
        tmp_path / "photo2.png",
    ]


def test_images_of_one_name_are_named_by_their_paths():
    files = [Path("a/color_00.png"), Path("color_00.png"), Path("a/color_01.png")]
    assert paths_by_name(files) == {
        str(files[0]): files[0],
        str(files[1]): files[1],
        "color_01.png": files[2],
    }


@pytest.mark.parametrize("pattern", ["chessboard", "circles"])
def test_progress_never_falls_and_ends_before_the_whole(tmp_path, pattern):
    board = Board(pattern, 5, 4, 0.05)
    files = [tmp_path / f"{index}.png" for index in range(6)]
    for path, T in zip(files, poses(board), strict=False):
        cv2.imwrite(str(path), photograph(board, T))
    shares = [
        step.fraction for step in iterate_calibration(files, board, folds=2) if isinstance(step, Progress)
    ]
    assert shares == sorted(shares)
    assert 0.0 <= shares[0] < 0.1
    assert 0.6 < shares[-1] <= 1.0


def test_a_warp_holds_out_every_view_even_if_no_others_are_held_out(tmp_path):
    """Of four views two folds would leave two for the lens, and it takes three."""
    files = [tmp_path / f"{index}.png" for index in range(4)]
    for path, T in zip(files, poses(BOARD), strict=False):
        cv2.imwrite(str(path), photograph(BOARD, T))
    report = drain(iterate_calibration(files, BOARD, folds=0, warp=True))
    assert len(report.warp.held_out) == 4
    assert report.warp.flat_rms_px < 0.2
