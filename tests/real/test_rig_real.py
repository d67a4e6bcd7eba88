"""Pairs of real cameras: a stereo rig before a chessboard, and a depth camera beside a grey one."""

import shutil

import cv2
import numpy as np
import pytest

from lab.datasets.sr300 import find, read_depth_bin
from packetmesh.progress import drain
from pipeline.calibration.board import Board
from pipeline.calibration.rig_from_images import iterate_rig_calibration
from pipeline.calibration.shots import node_shots
from pipeline.kernels.geometry import inverse, rigid, rotation_angle_rad
from tests.real.debian import opencv_doc, visp_images

BOARD = Board("chessboard", 9, 6, 0.025)
PUBLISHED_FOCAL_PX = 534.803
"""OpenCV's own stereo example of these images, one focal length for both (samples/data/intrinsics.yml)."""


@pytest.fixture(scope="module")
def stereo(tmp_path_factory):
    """The left and the right images of Debian's opencv-doc, a folder each."""
    data = opencv_doc()
    session = tmp_path_factory.mktemp("stereo")
    for side in ("left", "right"):
        (session / side).mkdir()
        for path in data.glob(f"{side}[01]*.jpg"):
            shutil.copy(path, session / side)
    return drain(iterate_rig_calibration(node_shots([session / "left", session / "right"]), BOARD, folds=2))


def test_a_stereo_rig_is_the_one_that_opencv_finds(stereo):
    left, right = stereo.cameras.values()
    seen = [{view.name[-6:-4]: view for view in one.views} for one in (left, right)]
    assert len(seen[0]) == len(seen[1]) == 13
    both = sorted(seen[0])
    lenses = [
        value for one in (left, right) for value in (one.calibration.matrix, one.calibration.distortion)
    ]
    rms_px, _, _, _, _, turn, move, *_ = cv2.stereoCalibrateExtended(
        [seen[0][moment].board_m.astype(np.float32) for moment in both],
        *([one[moment].points_px.astype(np.float32) for moment in both] for one in seen),
        *(value.copy() for value in lenses),
        (640, 480),
        np.eye(3),
        np.zeros((3, 1)),
        flags=cv2.CALIB_USE_INTRINSIC_GUESS | cv2.CALIB_FIX_K3 | cv2.CALIB_ZERO_TANGENT_DIST,
        criteria=(cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_MAX_ITER, 200, 1e-12),
    )
    pose = stereo.rig.relative("node_01")
    apart = inverse(pose.T_reference_camera) @ inverse(rigid(turn, np.ravel(move)))
    assert np.degrees(rotation_angle_rad(apart[:3, :3])) < 0.002
    assert np.linalg.norm(apart[:3, 3]) < 1e-5
    assert stereo.rig.rms_px == pytest.approx(rms_px, rel=1e-3)


def test_its_baseline_and_focal_length_are_those_of_two_cameras_side_by_side(stereo):
    pose = stereo.rig.relative("node_01")
    assert pose.baseline_m == pytest.approx(0.0829, abs=3.0 * pose.baseline_sd_m + 0.0005)
    assert pose.rotation_deg < 1.5
    assert abs(pose.T_reference_camera[0, 3]) > 0.99 * pose.baseline_m
    focal_px = np.mean([one.calibration.matrix[[0, 1], [0, 1]] for one in stereo.cameras.values()])
    assert focal_px == pytest.approx(PUBLISHED_FOCAL_PX, rel=0.003)
    assert stereo.rig.held_out.rms_px < 0.3


@pytest.fixture(scope="module")
def castle():
    """A grey image, and the depth beside it before and after it is registered."""
    images = visp_images()
    root = images / "mbt-depth" / "castel"
    (pair,) = [load() for load in find(root) if str(load.args[1]).endswith("image_0000.pgm")]
    raw_m = read_depth_bin(root / "castel" / "depth_image_0000.bin")
    return pair.rgb[..., 0], raw_m, pair.truth_m


def steps_of(z_m):
    """(H, W) where depth changes by more than 3 cm, within the castle's 1.2 m."""
    near_m = np.nan_to_num(np.where(z_m < 1.2, z_m, np.nan), nan=5.0).astype(np.float32)
    return cv2.morphologyEx(cv2.medianBlur(near_m, 5), cv2.MORPH_GRADIENT, np.ones((3, 3))) > 0.03


def test_registered_depth_steps_where_the_picture_has_edges(castle):
    """Those of a RealSense SR300's castle are 6 px from the picture's edges unregistered, and 2 px after."""
    grey, raw_m, registered_m = castle
    soft = cv2.GaussianBlur(grey, (0, 0), 1.2)
    slope = np.hypot(cv2.Sobel(soft, cv2.CV_32F, 1, 0), cv2.Sobel(soft, cv2.CV_32F, 0, 1))
    away_px = cv2.distanceTransform((slope <= 60.0).astype(np.uint8), cv2.DIST_L2, 5)
    before_px, after_px = (np.median(away_px[steps_of(z_m)]) for z_m in (raw_m, registered_m))
    assert after_px < 2.5
    assert 2.0 * after_px < before_px


def test_registered_depth_of_a_finer_camera_has_no_grid_of_holes(castle):
    _, _, registered_m = castle
    known = np.isfinite(registered_m)
    closed = cv2.morphologyEx(known.astype(np.uint8), cv2.MORPH_CLOSE, np.ones((3, 3))) > 0
    assert known[closed].mean() > 0.98
