"""``packetmesh calibrate`` with depth images beside the photographs."""

import json

import cv2
import numpy as np
import pytest

from app.cli import main
from pipeline.calibration.board import Board
from pipeline.io.depth_correction import read_depth_correction
from pipeline.kernels.geometry import pixel_rays
from pipeline.types import DepthMap
from tests.pipeline.calibration.views import CAMERA, photograph, poses

BOARD = Board("chessboard", 9, 6, 0.025)
ASKED = ["--pattern", "chessboard", "--columns", "9", "--rows", "6", "--spacing-mm", "25"]
SCALE = 1.05


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder, rng, rays = tmp_path_factory.mktemp("session"), np.random.default_rng(0), pixel_rays(CAMERA)
    for index, T in enumerate(poses(BOARD, 8)):
        cv2.imwrite(str(folder / f"color_{index:02d}.png"), photograph(BOARD, T))
        z_m = (T[:3, 2] @ T[:3, 3]) / (rays @ T[:3, 2])
        noisy_mm = 1000.0 * z_m / SCALE + rng.normal(0.0, 1.5, z_m.shape)
        cv2.imwrite(str(folder / f"depth_{index:02d}.png"), np.rint(noisy_mm).astype(np.uint16))
    return folder


def test_the_bias_is_told_and_written_where_a_rig_looks_for_it(folder, tmp_path, capsys):
    main(["calibrate", str(folder), *ASKED, "--out", str(tmp_path), "--json"])
    told = json.loads(capsys.readouterr().out)["depth"]
    assert {"terms", "values", "ci95", "noise_law", "rms_before_m", "rms_after_m"} <= told.keys()
    assert told["terms"] in (["offset"], ["scale"])
    assert told["rms_after_m"] < 0.2 * told["rms_before_m"]
    correction = read_depth_correction(tmp_path / "depth_correction.json")
    away_m = float(np.mean([T[2, 3] for T in poses(BOARD, 8)])) / SCALE
    flat = DepthMap(np.full((CAMERA.height_px, CAMERA.width_px), away_m, np.float32))
    assert np.nanmean(correction.apply(flat).z_m) == pytest.approx(SCALE * away_m, rel=0.003)
    page = (tmp_path / "report.html").read_text()
    assert "Bias of the depth sensor" in page
    assert "Noise of the depth" in page


def test_depth_that_cannot_be_used_is_told_and_the_camera_is_calibrated_anyway(folder, tmp_path, capsys):
    session = tmp_path / "session"
    session.mkdir()
    for path in folder.glob("*.png"):
        (session / path.name).write_bytes(path.read_bytes())
    small = np.full((240, 320), 1000, np.uint16)
    cv2.imwrite(str(session / "depth_00.png"), small)
    main(["calibrate", str(session), *ASKED, "--out", str(tmp_path / "camera")])
    assert "The depth sensor's bias is not known. The depth image of color_00.png" in capsys.readouterr().err
    assert (tmp_path / "camera" / "intrinsics.json").exists()
    assert not (tmp_path / "camera" / "depth_correction.json").exists()


def test_a_doubtful_scale_of_depth_is_said_and_can_be_stated(folder, tmp_path, capsys):
    session = tmp_path / "session"
    session.mkdir()
    for path in folder.glob("*.png"):
        image = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)
        cv2.imwrite(str(session / path.name), 5 * image if path.name.startswith("depth") else image)
    words = ["calibrate", str(session), *ASKED, "--out", str(tmp_path / "camera")]
    main(words)
    told = capsys.readouterr().err
    assert "Depth image of color_00.png: All depth values are multiples of 5" in told
    assert "try --depth-scale 5000" in told
    main([*words, "--depth-scale", "5000"])
    told = capsys.readouterr().err
    assert "multiples of 5" not in told
    assert "RMS depth error on the board" in told
