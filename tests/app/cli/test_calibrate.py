"""``packetmesh target`` and ``calibrate`` as somebody uses them, and what they say when they cannot."""

import json
import shutil

import cv2
import numpy as np
import pytest

from app.cli import main
from pipeline.calibration.board import Board
from pipeline.io.demos import SCENES
from pipeline.io.intrinsics import read_intrinsics
from pipeline.io.poses import read_pose
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
    assert "in held-out images" in said


def test_what_cannot_be_calibrated_is_one_sentence_and_leaves_no_folder(folder, tmp_path, capsys):
    out = ["--out", str(tmp_path / "camera")]
    assert "names no image" in failure(["calibrate", str(tmp_path / "none"), *ASKED, *out], capsys)
    two = [str(folder / "view0.png"), str(folder / "view1.png")]
    assert "it takes 3" in failure(["calibrate", *two, *ASKED, *out], capsys)
    small = tmp_path / "small.png"
    cv2.imwrite(str(small), np.zeros((48, 64), np.uint8))
    assert "not of one size" in failure(["calibrate", *two, str(small), *ASKED, *out], capsys)
    wrong = [*ASKED[:3], "7", *ASKED[4:]]
    told = failure(["calibrate", str(folder), *wrong, *out], capsys)
    assert "A chessboard of 9 x 6 inner corners is seen, not of 7 x 6; try --columns 9 --rows 6" in told
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
    assert "--spacing-mm 35.1\n" in capsys.readouterr().err
    grid = ["--pattern", "aprilgrid", "--columns", "6", "--rows", "6", "--pixel-mm", "0.3"]
    main(["target", "--out", str(tmp_path / "grid.png"), *grid])
    assert "--spacing-mm 35.1 --tag-spacing 0.299145\n" in capsys.readouterr().err  # 35 of 117 pixels
    assert "size of its pixels" in failure(["target", "--out", str(tmp_path / "x.png")], capsys)


def test_a_verdict_is_given_at_the_range_and_accuracy_that_one_names(folder, tmp_path, capsys):
    words = ["calibrate", str(folder), *ASKED, "--out", str(tmp_path / "camera"), "--range-m", "1", "--json"]
    main([*words, "--accuracy-mm", "50"])
    good = json.loads(capsys.readouterr().out)["trust"]
    main([*words, "--accuracy-mm", "0.01"])
    bad = json.loads(capsys.readouterr().out)["trust"]
    assert (good["passed"], bad["passed"]) == (True, False)
    assert good["sentence"].startswith(
        "At 1 m a point is placed within 50 mm over 95 % of the image with a prob"
    )
    assert (good["probability"], bad["probability"], bad["failed"]) == (1.0, 0.0, True)
    assert good["error_of_most_m"] == pytest.approx(bad["error_of_most_m"])
    assert 0.0 < good["coverage"] <= 1.0
    assert good["next_view"]["error_after_m"] < good["next_view"]["error_before_m"]
    page = (tmp_path / "camera" / "report.html").read_text()
    assert page.count("plotly-graph-div") >= 8
    assert "No chessboard of" in page


def test_images_are_left_out_by_name_and_the_board_bent_only_on_demand(folder, tmp_path, capsys):
    words = ["calibrate", str(folder), *ASKED, "--out", str(tmp_path / "camera"), "--json"]
    main([*words, "--without", "view1.png", "wall.png"])
    told = json.loads(capsys.readouterr().out)
    assert told["left_out"] == ["view1.png", "wall.png"]
    assert told["board_warp"] is None
    used = {view["image"]: view["used"] for view in told["views"]}
    assert used["view0.png"]
    assert not used["view1.png"]
    main([*words, "--board-warp"])
    warp = json.loads(capsys.readouterr().out)["board_warp"]
    assert warp["warp_m"] < 0.002
    assert warp["used"] == (warp["held_out_rms_px"] < warp["held_out_rms_px_flat"])


def test_a_fisheye_is_written_where_it_is_known_and_read_by_the_chain(folder, tmp_path, capsys):
    main(["calibrate", str(folder), *ASKED, "--lens", "fisheye", "--out", str(tmp_path / "camera")])
    said = capsys.readouterr().err
    assert "matlab.txt is not written: MATLAB's file cannot hold a fisheye" in said
    written = {path.name for path in (tmp_path / "camera").iterdir()}
    assert {"camera.yaml", "camera_info.yaml", "cameras.txt", "camchain.yaml", "report.html"} <= written
    assert not {"matlab.txt", "open3d.json"} & written
    camera = read_intrinsics(tmp_path / "camera" / "intrinsics.json")
    assert (camera.fisheye, len(camera.distortion)) == (True, 4)


def test_few_images_are_held_out_one_by_one(folder, tmp_path, capsys):
    four = [str(folder / f"view{index}.png") for index in range(4)]
    main(["calibrate", *four, *ASKED, "--out", str(tmp_path / "camera"), "--json"])
    told = json.loads(capsys.readouterr().out)
    assert told["held_out_rms_px"] > told["rms_px"]
    assert told["trust"]["halves"] is None


CIRCLES = Board()


@pytest.fixture(scope="module")
def circles(tmp_path_factory):
    folder = tmp_path_factory.mktemp("circles")
    for index, T in enumerate(poses(CIRCLES, 4)):
        cv2.imwrite(str(folder / f"view{index}.png"), photograph(CIRCLES, T))
    return folder


@pytest.mark.parametrize(
    ("given", "says"),
    [
        (["--columns", "12"], "not 12 x 9 circles in straight rows"),
        (["--rows", "10"], "not 11 x 10 circles in straight rows"),
        (["--spacing-mm", "0"], "spacing of 0 m"),
        (["--spacing-mm", "-35"], "spacing of -35 mm"),
        (["--without", "nobody.png"], "nobody.png is not among the images"),
        (["--without", "view0.png", "view1.png"], "2 of 4 images, 2 left out"),
        (["--range-m", "0"], "range of 0 m"),
        (["--accuracy-mm", "0"], "accuracy of 0 mm"),
        (["--board-warp", "--lens", "fisheye"], "warp cannot be found with a fisheye"),
        (["--board-warp", "--without", "view0.png"], "warp takes 4 views, because some are held out, and 3"),
    ],
)
def test_wrong_options_are_one_sentence_each(given, says, circles, tmp_path, capsys):
    out = tmp_path / "camera"
    assert says in failure(["calibrate", str(circles), "--out", str(out), *given], capsys)
    assert not out.exists()


@pytest.mark.parametrize("name", ["", "node_00"])
def test_a_rigs_own_cameras_stay(name, circles, tmp_path, capsys):
    """A calibration without a depth camera would delete that of the rig."""
    rig = tmp_path / "rig"
    shutil.copytree(SCENES / "box-on-table" / "node_00", rig / "node_00")
    before = {path: path.read_bytes() for path in rig.rglob("*") if path.is_file()}
    says = failure(["calibrate", str(circles), "--out", str(rig / name)], capsys)
    assert "the results would replace its cameras" in says
    assert {path: path.read_bytes() for path in rig.rglob("*") if path.is_file()} == before


@pytest.mark.parametrize(
    ("spoil", "says"),
    [
        (lambda picture: cv2.GaussianBlur(picture, (0, 0), 25.0), "sharp"),
        (lambda picture: picture[:, :400], "of 99 circles are seen"),
        (lambda picture: np.full_like(picture, 200), "Nothing in it looks like a circle"),
    ],
    ids=["blurred", "partial", "no board"],
)
def test_photographs_without_a_whole_sharp_board_say_why(spoil, says, circles, tmp_path, capsys):
    for path in circles.iterdir():
        cv2.imwrite(str(tmp_path / path.name), spoil(cv2.imread(str(path), cv2.IMREAD_GRAYSCALE)))
    words = ["calibrate", str(tmp_path), "--out", str(tmp_path / "camera")]
    assert says in failure(words, capsys)


def test_one_image_and_an_empty_folder_are_not_enough(circles, tmp_path, capsys):
    out = ["--out", str(tmp_path / "camera")]
    assert "1 of 1 images" in failure(["calibrate", str(circles / "view0.png"), *out], capsys)
    (tmp_path / "empty").mkdir()
    assert "names no image" in failure(["calibrate", str(tmp_path / "empty"), *out], capsys)


def test_a_wrong_spacing_cannot_be_seen_but_the_distances_can_be_checked(circles, tmp_path, capsys):
    for spacing_mm in ("35", "70"):
        out = ["--out", str(tmp_path / spacing_mm), "--spacing-mm", spacing_mm]
        main(["calibrate", str(circles), "--held-out", "0", *out])
        assert "if that is wrong, correct --spacing-mm" in capsys.readouterr().err
    cameras = [read_intrinsics(tmp_path / mm / "intrinsics.json") for mm in ("35", "70")]
    assert cameras[0].fx_px == pytest.approx(cameras[1].fx_px, rel=1e-4)


@pytest.fixture(scope="module")
def pair(tmp_path_factory):
    """Photographs of two cameras of one size, the second 3 cm to the right."""
    session = tmp_path_factory.mktemp("pair")
    beside = np.eye(4)
    beside[0, 3] = -0.03
    for index, T in enumerate(poses(BOARD, 6)):
        T[:3, 3] *= 1.25
        for name, T_camera_first in (("left", np.eye(4)), ("right", beside)):
            (session / name).mkdir(exist_ok=True)
            picture = photograph(BOARD, T_camera_first @ T)
            cv2.imwrite(str(session / name / f"{name}{index}.png"), picture)
    (session / "board.json").write_text(
        '{"pattern": "chessboard", "columns": 9, "rows": 6, "spacing_mm": 25}'
    )
    return session


def test_two_folders_are_two_cameras_and_their_calibration_is_laid_over_a_rig(pair, tmp_path, capsys):
    out = tmp_path / "cal"
    main(["calibrate", str(pair / "left"), str(pair / "right"), "--out", str(out), "--json"])
    told = json.loads(capsys.readouterr().out)
    assert told == json.loads((out / "metrics.json").read_text())
    assert {"cameras", "extrinsics", "rms_px", "held_out_rms_px"} <= told.keys()
    assert list(told["cameras"]) == ["node_00", "node_01"]
    assert {"rms_px", "matrix", "standard_errors", "views", "trust"} <= told["cameras"]["node_01"].keys()
    (pose,) = told["extrinsics"]
    assert (pose["camera"], pose["reference"], pose["moments"]) == ("node_01", "node_00", 6)
    assert pose["baseline_m"] == pytest.approx(0.03, abs=0.001)
    assert pose["rotation_deg"] < 0.1
    first, second = (read_pose(out / name / "pose.txt") for name in ("node_00", "node_01"))
    np.testing.assert_allclose((np.linalg.inv(first) @ second)[:3, 3], (0.03, 0.0, 0.0), atol=0.001)
    assert read_intrinsics(out / "node_01" / "intrinsics.json").fx_px == pytest.approx(CAMERA.fx_px, rel=0.01)
    assert (out / "node_01" / "report.html").is_file()


def test_two_cameras_in_words(pair, tmp_path, capsys):
    main(["calibrate", str(pair / "left"), str(pair / "right"), "--out", str(tmp_path / "cal")])
    said = capsys.readouterr().err
    assert "node_01 from node_00: turned by" in said
    assert "6 moments in common" in said
    assert "at held-out moments" in said


def test_cameras_that_cannot_be_placed_are_one_sentence_and_leave_no_folder(pair, tmp_path, capsys):
    out = ["--out", str(tmp_path / "cal")]
    session = tmp_path / "session"
    for name, first in (("left", 0), ("right", 10)):
        (session / name).mkdir(parents=True)
        for index in range(4):
            picture = (pair / name / f"{name}{index}.png").read_bytes()
            (session / name / f"{first + index}.png").write_bytes(picture)
    folders = [str(session / "left"), str(session / "right")]
    assert "node_01 never sees the board at a moment" in failure(
        ["calibrate", *folders, *ASKED, *out], capsys
    )
    (session / "empty").mkdir()
    empty = ["calibrate", folders[0], str(session / "empty"), *ASKED, *out]
    assert "holds no image of a camera" in failure(empty, capsys)
    (session / "node_00").mkdir()
    (session / "node_00" / "0.png").write_bytes((session / "left" / "0.png").read_bytes())
    assert "holds one camera only" in failure(["calibrate", str(session), *ASKED, *out], capsys)
    warp = failure(["calibrate", *folders, *ASKED, "--board-warp", *out], capsys)
    assert warp.count("--board-warp works with one camera") == 1
    like = ["calibrate", *folders, *ASKED, "--like", str(tmp_path), *out]
    assert "has no node_00/pose.txt" in failure(like, capsys)
    assert not (tmp_path / "cal").exists()
