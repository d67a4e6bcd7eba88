"""What a command line names is what the source says of itself, and what does not fit is one sentence."""

import numpy as np
import pytest
import tyro

from app.cli.options import SourceOptions
from pipeline.io.calibrations import CalibratedNode, write_calibration
from pipeline.io.extrinsics import write_extrinsics
from pipeline.io.images import write_color, write_depth_mm
from pipeline.io.intrinsics import write_intrinsics
from pipeline.kernels.geometry import rigid
from pipeline.sources import Calibrated, Demo, ImagePair, Recorded, RigFolder, demo_of
from pipeline.types import CameraIntrinsics, DepthMap
from tests.app.commands import check_one_sentence, run

PAIR = ImagePair("c.png", "d.png", "k.json")
UNREGISTERED = ImagePair("c.png", "d.png", "k.json", 5000.0, "kd.json", "e.json")


@pytest.mark.parametrize(
    "source",
    [
        Demo("office"),
        demo_of("living-room-walk"),
        RigFolder("my rig"),
        RigFolder("my rig", 5000.0),
        PAIR,
        UNREGISTERED,
        Calibrated(Demo("office"), "cal"),
        Calibrated(RigFolder("my rig"), "cal"),
        Calibrated(UNREGISTERED, "cal"),
    ],
)
def test_the_arguments_of_a_source_name_it(source):
    assert tyro.cli(SourceOptions, args=source.arguments()).source() == source


def test_a_depth_camera_needs_its_lens_and_its_place(capsys):
    words = ["--color", "c.png", "--depth", "d.png", "--intrinsics", "k.json", "--extrinsics", "e.json"]
    got = run(capsys, "reconstruct", *words, "--out", "out")
    check_one_sentence(got, 2, "needs both --depth-intrinsics and --extrinsics")


def test_a_demo_has_its_own_depth_scale(capsys):
    got = run(capsys, "reconstruct", "--scene", "office", "--depth-scale", 5000, "--out", "out")
    check_one_sentence(got, 2, "a demo scene has its own depth scale")


def test_a_demo_may_be_a_recording_which_keeps_its_camera(capsys):
    source = demo_of("living-room-walk")
    assert isinstance(source, Recorded)
    assert source.title == "living-room-walk"
    got = run(capsys, "reconstruct", "--scene", source.title, "--calibration", "cal", "--out", "out")
    check_one_sentence(got, 2, "living-room-walk is a recording, which takes no --calibration")


def test_a_calibration_of_another_rig_leaves_no_folder(capsys, tmp_path):
    camera = CameraIntrinsics.pinhole(600.0, 600.0, 320.0, 240.0, 640, 480)
    write_calibration(tmp_path / "cal", {"node_07": CalibratedNode(camera)})
    out = tmp_path / "out"
    for folder, sentence in (("cal", "is of node_07, and the rig has node_00"), ("none", "does not exist")):
        words = ["reconstruct", "--scene", "office", "--calibration", tmp_path / folder, "--out", out]
        check_one_sentence(run(capsys, *words), 1, sentence)
    assert not out.exists()


def test_an_unregistered_pair_is_registered(tmp_path):
    """A plane 2 m before the depth camera, which stands 5 cm behind the colour camera."""
    write_color(tmp_path / "c.png", np.zeros((48, 64, 3), np.uint8))
    write_depth_mm(tmp_path / "d.png", DepthMap(np.full((24, 32), 2.0, np.float32)))
    write_intrinsics(tmp_path / "k.json", CameraIntrinsics.pinhole(60.0, 60.0, 31.5, 23.5, 64, 48))
    write_intrinsics(tmp_path / "kd.json", CameraIntrinsics.pinhole(26.0, 26.0, 15.5, 11.5, 32, 24))
    write_extrinsics(tmp_path / "e.json", rigid(np.eye(3), np.array([0.0, 0.0, -0.05])))
    files = [str(tmp_path / name) for name in ("c.png", "d.png", "k.json", "kd.json", "e.json")]
    frame = ImagePair(*files[:3], 1000.0, *files[3:]).load().frames[0]
    assert frame.depth.coverage > 0.95
    np.testing.assert_allclose(frame.depth.z_m[frame.depth.valid], 1.95, atol=1e-6)
