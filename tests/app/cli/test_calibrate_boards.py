"""``packetmesh calibrate`` and ``target`` with boards of strangers, and with what cannot be a camera."""

import json
import re

import cv2
import numpy as np
import pytest

from app.cli import main
from pipeline.calibration.board import Board
from pipeline.calibration.target import write_target
from tests.app.cli.test_calibrate import failure
from tests.pipeline.calibration.views import CAMERA, photograph, poses

SHIFTED = Board("circles-asymmetric", 4, 10, 0.018)
CHARUCO = Board("charuco", 6, 5, 0.03, "4X4_50")
TAGS = Board("aprilgrid", 5, 4, 0.05, tag_spacing=0.25)


def options(board):
    words = ["--pattern", board.pattern, "--columns", str(board.columns), "--rows", str(board.rows)]
    return [*words, "--spacing-mm", f"{1000.0 * board.spacing_m:g}"]


def photographs(folder, board, count=6):
    folder.mkdir(exist_ok=True)
    for index, T in enumerate(poses(board, count)):
        cv2.imwrite(str(folder / f"view{index}.png"), photograph(board, T))
    return folder


@pytest.mark.parametrize("board", [SHIFTED, CHARUCO, TAGS], ids=lambda board: board.pattern)
def test_a_board_that_target_prints_calibrates_the_camera(board, tmp_path, capsys):
    folder = photographs(tmp_path / "views", board)
    more = ["--tag-spacing", "0.25"] if board is TAGS else []
    out = tmp_path / "camera"
    main(["calibrate", str(folder), *options(board), *more, "--out", str(out), "--held-out", "0", "--json"])
    told = json.loads(capsys.readouterr().out)
    assert [view["found"] for view in told["views"]] == [True] * 6
    assert told["matrix"][0][0] == pytest.approx(CAMERA.fx_px, rel=0.01)
    assert told["rms_px"] < 0.2


def test_two_cameras_that_see_shifted_rows_without_a_mark_are_placed(tmp_path, capsys):
    """The mark is painted over, so that every view may be upside down; the two cameras have to agree."""
    beside = np.eye(4)
    beside[0, 3] = -0.03
    for index, T in enumerate(poses(SHIFTED, 6)):
        T[:3, 3] *= 1.25
        for name, T_camera_first in (("left", np.eye(4)), ("right", beside)):
            pose = T_camera_first @ T
            picture = photograph(SHIFTED, pose)
            point = CAMERA.matrix @ (pose[:3, :3] @ SHIFTED.points_m[0] + pose[:3, 3])
            x, y = np.rint(point[:2] / point[2]).astype(int).tolist()
            cv2.circle(picture, (x, y), 5, int(picture[y, x]), -1)
            cv2.imwrite(str(tmp_path / f"{name}-{index:04d}.png"), picture)
    words = ["calibrate", str(tmp_path), *options(SHIFTED), "--rig", "--held-out", "0", "--json"]
    main([*words, "--out", str(tmp_path / "rig")])
    told = capsys.readouterr()
    (pose,) = json.loads(told.out)["extrinsics"]
    assert pose["baseline_m"] == pytest.approx(0.03, abs=0.001)
    assert pose["rotation_deg"] < 0.2
    assert "node_01: right-0000.png and so on, 6 images" in told.err


def test_two_cameras_in_one_folder_are_refused_and_each_remedy_is_taken(tmp_path, capsys):
    board = Board("chessboard", 9, 6, 0.025)
    folder = tmp_path / "both"
    folder.mkdir()
    for index, T in enumerate(poses(board, 4)):
        for name in ("cam0", "cam1"):
            cv2.imwrite(str(folder / f"{name}_{index:03d}.png"), photograph(board, T))
    words = [*options(board), "--held-out", "0", "--out", str(tmp_path / "out")]
    told = failure(["calibrate", str(folder), *words], capsys)
    assert "2 cameras by their names: 4 of 'cam0' and 4 of 'cam1'" in told
    assert not (tmp_path / "out").exists()
    pattern = re.search(r'alone by "([^"]+)"', told)[1]
    main(["calibrate", str(folder / pattern), *words])
    assert "over 4 images" in capsys.readouterr().err
    main(["calibrate", str(folder), "--one-camera", *words])
    assert "over 8 images" in capsys.readouterr().err
    both = ["calibrate", str(folder), "--one-camera", "--rig", *words]
    assert "--rig and --one-camera contradict each other" in failure(both, capsys)
    alone = ["calibrate", str(folder / pattern), "--rig", *words]
    assert "do not tell cameras apart" in failure(alone, capsys)


def test_images_of_two_sizes_ask_for_a_folder_each(tmp_path, capsys):
    folder = photographs(tmp_path / "views", SHIFTED, 3)
    cv2.imwrite(str(folder / "zoomed.png"), np.full((960, 1280), 200, np.uint8))
    out = tmp_path / "out"
    told = failure(["calibrate", str(folder), *options(SHIFTED), "--out", str(out)], capsys)
    assert "640 x 480 and zoomed.png of 1280 x 960; give each camera's images a folder of its own" in told
    assert not out.exists()


def test_a_camera_that_cannot_be_is_one_sentence_without_a_file(tmp_path, capsys):
    """Photographs squeezed to half their width, as no sensor has its pixels."""
    board = Board("chessboard", 9, 6, 0.025)
    folder = photographs(tmp_path / "views", board, 4)
    words = ["calibrate", str(folder), *options(board), "--held-out", "0", "--out", str(tmp_path / "out")]
    main(words)
    for path in folder.iterdir():
        cv2.imwrite(str(path), cv2.resize(cv2.imread(str(path)), (320, 480), interpolation=cv2.INTER_AREA))
    capsys.readouterr()
    words[-1] = str(tmp_path / "none")
    told = failure(words, capsys)
    assert re.search(
        r"The camera that fits best has focal lengths of (29|30)\d.* px along rows and 60\d", told
    )
    assert "so it cannot be right" in told
    assert not (tmp_path / "none").exists()


def test_a_printed_aprilgrid_has_the_tags_of_kalibr(tmp_path):
    """Tag 0 of Kalibr's family 36h11 is 0xd5d628584, its first bit at the upper left, white for 1."""
    board = Board("aprilgrid", 2, 2, 0.1)
    write_target(board, tmp_path / "board.png", pixel_mm=1.0)
    picture = cv2.imread(str(tmp_path / "board.png"), cv2.IMREAD_GRAYSCALE)
    rows, columns = np.nonzero(picture[: 15 + 290 + 30] < 128)
    left, top = columns.min(), rows.min()
    # A gap of 30 mm, an upper row of tags of 100 mm, another gap; the cells of tag 0 are 10 mm wide.
    centre = np.arange(10) * 10 + 5
    cells = picture[np.ix_(top + 30 + 130 + centre, left + 30 + centre)] > 128
    assert not cells[[0, 1, 8, 9]].any()
    assert not cells[:, [0, 1, 8, 9]].any()
    bits = "".join(str(int(cell)) for cell in cells[2:8, 2:8].ravel())
    assert int(bits, 2) == 0xD5D628584


def test_target_says_what_a_dictionary_is_for(tmp_path, capsys):
    out = ["--out", str(tmp_path / "board.pdf")]
    assert "no dictionary to choose" in failure(["target", *out, "--dictionary", "4X4_50"], capsys)
    wrong = ["target", *out, "--pattern", "charuco", "--dictionary", "mine"]
    assert "There is no dictionary 'mine'" in failure(wrong, capsys)
    main(["target", *out, "--pattern", "aprilgrid", "--columns", "6", "--rows", "6", "--spacing-mm", "24"])
    assert "AprilGrid of 6 x 6 tags, tag spacing 0.3, tags of 24 mm" in capsys.readouterr().err
