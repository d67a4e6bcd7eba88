"""The standard error of a calibrated focal length goes with the camera to the frame that is measured."""

import json
from dataclasses import replace

import numpy as np
import pytest

from pipeline.io.calibrations import CalibratedNode, write_calibration
from pipeline.io.depth_correction import DepthCorrection, write_depth_correction
from pipeline.io.intrinsics import read_focal_sd, write_intrinsics
from pipeline.io.rigs import load_rig, save_rig
from pipeline.types import CameraIntrinsics, DepthMap, RgbdFrame, Rig

CAMERA = CameraIntrinsics.pinhole(10.0, 10.0, 1.5, 0.5, 4, 2)


@pytest.fixture
def rig():
    image = np.zeros((2, 4, 3), np.uint8), DepthMap(np.ones((2, 4), np.float32))
    return Rig("rig", (RgbdFrame("node_00", *image, CAMERA, np.eye(4)),))


def test_a_calibration_makes_the_rigs_scale_sure(tmp_path, rig):
    save_rig(tmp_path / "rig", rig)
    assert load_rig(tmp_path / "rig").frames[0].scale_sd is None
    write_calibration(tmp_path / "cal", {"node_00": CalibratedNode(CAMERA, focal_sd=0.0025)})
    assert load_rig(tmp_path / "rig", tmp_path / "cal").frames[0].scale_sd == 0.0025


def test_the_depths_own_scale_counts_if_it_is_less_sure(tmp_path, rig):
    save_rig(tmp_path / "rig", rig)
    write_calibration(tmp_path / "cal", {"node_00": CalibratedNode(CAMERA, focal_sd=0.0025)})
    correction = DepthCorrection((4, 2), ci95={"scale": np.array([0.98, 1.02])})
    write_depth_correction(tmp_path / "cal" / "node_00" / "depth_correction.json", correction)
    sd = load_rig(tmp_path / "rig", tmp_path / "cal").frames[0].scale_sd
    assert sd == pytest.approx(0.02 / 1.96, rel=1e-3)


def test_a_saved_rig_keeps_it(tmp_path, rig):
    known = replace(rig, frames=(replace(rig.frames[0], scale_sd=0.004),))
    save_rig(tmp_path / "rig", known)
    assert load_rig(tmp_path / "rig").frames[0].scale_sd == 0.004


@pytest.mark.parametrize("value", ["wide", -0.1, 7, None])
def test_what_is_no_share_is_ignored(tmp_path, value):
    path = tmp_path / "intrinsics.json"
    write_intrinsics(path, CAMERA, 0.001)
    path.write_text(json.dumps(json.loads(path.read_text()) | {"focal_sd": value}))
    assert read_focal_sd(path) is None
    path.write_text("10 0 1.5 0 10 0.5 0 0 1")
    assert read_focal_sd(path) is None
