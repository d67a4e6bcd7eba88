"""``packetmesh target`` and ``calibrate`` as somebody uses them, and what they say when they cannot."""

import json

import cv2
import numpy as np
import pytest

from app.cli import main
from pipeline.calibration.board import Board
from pipeline.io.intrinsics import read_intrinsics
from tests.pipeline.calibration.views import CAMERA, photograph, poses

BOARD = Board("chessboard", 9, 6, 0.025)
ASKED = ["--pattern", "chessboard", "--columns", "9", "--rows", "6", "--spacing-mm", "25"]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("photographs")
    for index, T in enumerate(poses(BOARD, 6)):
        cv2.imwrite(str(folder / f"view{index}.png"), photograph(BOARD, T))
    cv2.imwrite(str(folder / "wall.png"), np.full((480, 640), 200, np.uint8))
    return folder


def failure(words, capsys):
    with pytest.raises(SystemExit) as stopped:
        main(words)
    assert stopped.value.code == 1
    return capsys.readouterr().err.splitlines()[-1]


def test_a_folder_of_photographs_gives_the_camera_that_took_them(folder, tmp_path, capsys):
    main(["calibrate", str(folder), *ASKED, "--out", str(tmp_path / "camera"), "--json"])
    told = json.loads(capsys.readouterr().out)
    assert told == json.loads((tmp_path / "camera" / "metrics.json").read_text())
    assert {"rms_px", "held_out_rms_px", "matrix", "distortion", "standard_errors", "views"} <= told.keys()
    assert told["matrix"][0][0] == pytest.approx(CAMERA.fx_px, rel=0.01)
    assert [view["found"] for view in told["views"]] == [True] * 6 + [False]
    assert "No chessboard" in told["views"][-1]["reason"]
    camera = read_intrinsics(tmp_path / "camera" / "intrinsics.json")
    assert camera.fx_px == told["matrix"][0][0]
    for name in ("camera.yaml", "camera_info.yaml", "cameras.txt", "camchain.yaml", "matlab.txt"):
        np.testing.assert_allclose(
            read_intrinsics(tmp_path / "camera" / name).matrix, camera.matrix, rtol=1e-12
        )


def test_a_pattern_names_images_and_text_says_how_sure_each_number_is(folder, tmp_path, capsys):
    main(["calibrate", str(folder / "view*.png"), *ASKED, "--out", str(tmp_path / "camera")])
    said = capsys.readouterr().err
    assert "fx" in said
    assert "95 %" in said
    assert "in images that it has not seen" in said


def test_what_cannot_be_calibrated_is_one_sentence_and_leaves_no_folder(folder, tmp_path, capsys):
    out = ["--out", str(tmp_path / "camera")]
    assert "names no image" in failure(["calibrate", str(tmp_path / "none"), *ASKED, *out], capsys)
    two = [str(folder / "view0.png"), str(folder / "view1.png")]
    assert "it takes 3" in failure(["calibrate", *two, *ASKED, *out], capsys)
    small = tmp_path / "small.png"
    cv2.imwrite(str(small), np.zeros((48, 64), np.uint8))
    assert "not of one size" in failure(["calibrate", *two, str(small), *ASKED, *out], capsys)
    wrong = [*ASKED[:3], "7", *ASKED[4:]]
    assert "count the corners" in failure(["calibrate", str(folder), *wrong, *out], capsys)
    assert "leaves no view" in failure(["calibrate", str(folder), *ASKED, "--held-out", "1", *out], capsys)
    same = [str(tmp_path / f"same{index}.png") for index in range(3)]
    for path in same:
        cv2.imwrite(path, photograph(BOARD, poses(BOARD)[0]))
    assert "nearly the same direction" in failure(
        ["calibrate", *same, *ASKED, "--held-out", "0", *out], capsys
    )
    assert not (tmp_path / "camera").exists()


def test_a_board_is_drawn_and_says_what_it_is(tmp_path, capsys):
    main(["target", "--out", str(tmp_path / "board.pdf")])
    assert "11 x 9 circles, pitch 35 mm" in capsys.readouterr().err
    assert (tmp_path / "board.pdf").read_bytes().startswith(b"%PDF")
    main(["target", "--out", str(tmp_path / "board.png"), "--pixel-mm", "0.3"])
    assert "--spacing-mm 35.1" in capsys.readouterr().err
    assert "how large its pixels are" in failure(["target", "--out", str(tmp_path / "x.png")], capsys)
