"""A calibration laid over a rig: its files take the place of the rig's own, and the truth stays."""

import json

import numpy as np
import pytest

from packetmesh.errors import InputError
from pipeline.io.calibrations import CalibratedNode, calibration_files, write_calibration
from pipeline.io.demos import SCENES
from pipeline.io.depth_correction import DepthCorrection, write_depth_correction
from pipeline.io.extrinsics import read_extrinsics, write_extrinsics
from pipeline.io.images import write_color, write_depth_mm
from pipeline.io.intrinsics import write_intrinsics
from pipeline.io.poses import read_pose, write_pose
from pipeline.io.rigs import load_rig, save_rig
from pipeline.kernels.geometry import look_at, rigid, rotation_exp
from pipeline.sources import Calibrated, Demo, ImagePair, RigFolder
from pipeline.spec import Spec
from pipeline.types import CameraIntrinsics, DepthMap, DepthNoise, RgbdFrame, Rig

CAMERA = CameraIntrinsics.pinhole(14.0, 14.5, 7.5, 5.5, 16, 12)
BETTER = CameraIntrinsics(CAMERA.matrix * 1.0, np.array([-0.1, 0.02, 0.0, 0.0, 0.0]), 16, 12)
POSE = look_at([1.0, 2.0, 0.5], [0.0, 0.0, 0.0])
RNG = np.random.default_rng(0)


@pytest.fixture
def rig(tmp_path):
    frames = tuple(
        RgbdFrame(
            f"node_{index:02d}",
            RNG.integers(0, 256, (12, 16, 3), dtype=np.uint8),
            DepthMap(np.full((12, 16), 2.0, np.float32)),
            CAMERA,
            np.eye(4),
        )
        for index in range(2)
    )
    save_rig(tmp_path / "rig", Rig("rig", frames))
    return tmp_path / "rig"


@pytest.fixture
def calibration(tmp_path):
    nodes = {"node_00": CalibratedNode(BETTER, POSE), "node_01": CalibratedNode(BETTER, np.eye(4))}
    write_calibration(tmp_path / "cal", nodes)
    return tmp_path / "cal"


def test_cameras_and_poses_are_those_of_the_calibration_and_images_those_of_the_rig(rig, calibration):
    before, after = load_rig(rig), load_rig(rig, calibration)
    for old, new in zip(before.frames, after.frames, strict=True):
        np.testing.assert_array_equal(new.intrinsics.distortion, BETTER.distortion)
        np.testing.assert_array_equal(new.rgb, old.rgb)
        np.testing.assert_array_equal(new.depth.z_m, old.depth.z_m)
    np.testing.assert_array_equal(after.frames[0].T_world_camera, POSE)


def test_a_depth_correction_is_applied_once_whoever_brings_it(rig, calibration):
    noise = DepthNoise(0.001, 0.002, 2.0, 1.0)
    for folder, scale in ((rig, 1.10), (calibration, 1.05)):
        correction = DepthCorrection((16, 12), scale=scale, noise=noise)
        write_depth_correction(folder / "node_00" / "depth_correction.json", correction)
    own, laid_over = load_rig(rig), load_rig(rig, calibration)
    np.testing.assert_allclose(own.frames[0].depth.z_m, 2.2, rtol=1e-6)
    np.testing.assert_allclose(laid_over.frames[0].depth.z_m, 2.1, rtol=1e-6)
    assert laid_over.frames[0].noise == noise
    assert laid_over.frames[1].noise is None


def test_a_calibration_without_poses_does_not_keep_older_ones(tmp_path):
    """The bias of the depth sensor was measured with the older lens."""
    separate = CalibratedNode(BETTER, POSE, depth_intrinsics=CAMERA, T_color_depth=np.eye(4))
    write_calibration(tmp_path, {"node_00": separate})
    write_depth_correction(tmp_path / "node_00" / "depth_correction.json", DepthCorrection((16, 12)))
    assert len(calibration_files(tmp_path, ["node_00"])["node_00"]) == 5
    write_calibration(tmp_path, {"node_00": CalibratedNode(BETTER)})
    assert calibration_files(tmp_path, ["node_00"])["node_00"].keys() == {"intrinsics"}


def test_a_pose_alone_leaves_the_rest_of_an_earlier_calibration(tmp_path):
    write_calibration(tmp_path, {"node_00": CalibratedNode(BETTER, np.eye(4))})
    write_depth_correction(tmp_path / "node_00" / "depth_correction.json", DepthCorrection((16, 12)))
    write_calibration(tmp_path, {"node_00": CalibratedNode(None, POSE)})
    kept = calibration_files(tmp_path, ["node_00"])["node_00"]
    assert kept.keys() == {"intrinsics", "pose", "depth_correction"}
    np.testing.assert_array_equal(read_pose(kept["pose"]), POSE)


@pytest.mark.parametrize("has", ["color.png", "depth.npy"])
def test_a_rigs_own_cameras_are_not_replaced(has, tmp_path):
    """An image is enough: intrinsics may come from a calibration elsewhere."""
    node = tmp_path / "node_00"
    write_pose(node / "pose.txt", POSE)
    (node / has).touch()
    with pytest.raises(InputError, match="has the images of a rig"):
        write_calibration(tmp_path, {"node_00": CalibratedNode(BETTER)})
    assert {file.name for file in node.iterdir()} == {"pose.txt", has}


def test_nodes_of_a_larger_calibration_are_not_mixed_with_new_ones(calibration):
    before = {path: path.read_bytes() for path in calibration.rglob("*.*")}
    with pytest.raises(InputError, match="already holds the calibration of node_01, which is not among"):
        write_calibration(calibration, {"node_00": CalibratedNode(CAMERA, POSE)})
    assert {path: path.read_bytes() for path in calibration.rglob("*.*")} == before


def test_the_truth_of_a_demo_stays(tmp_path):
    plain = Demo("office").load()
    camera = plain.frames[0].intrinsics
    wrong = CameraIntrinsics(
        camera.matrix * [[1.1], [1.1], [1.0]], camera.distortion, camera.width_px, camera.height_px
    )
    nodes = {frame.name: CalibratedNode(wrong, POSE) for frame in plain.frames}
    write_calibration(tmp_path, nodes)
    laid_over = Calibrated(Demo("office"), str(tmp_path)).load()
    assert laid_over.frames[0].intrinsics.fx_px == pytest.approx(1.1 * camera.fx_px)
    for old, new in zip(plain.truth.depth, laid_over.truth.depth, strict=True):
        np.testing.assert_array_equal(new.z_m, old.z_m)
    for old, new in zip(plain.truth.T_world_camera, laid_over.truth.T_world_camera, strict=True):
        np.testing.assert_array_equal(new, old)


def test_a_single_pair_takes_the_first_node(rig, tmp_path):
    write_calibration(tmp_path / "one", {"node_00": CalibratedNode(BETTER, POSE)})
    files = (str(rig / "node_00" / name) for name in ("color.png", "depth.png", "intrinsics.json"))
    frame = Calibrated(ImagePair(*files), str(tmp_path / "one")).load().frames[0]
    np.testing.assert_array_equal(frame.T_world_camera, POSE)
    np.testing.assert_array_equal(frame.intrinsics.distortion, BETTER.distortion)


def test_the_command_names_the_calibration():
    spec = Spec(Calibrated(RigFolder("my rig"), "cal"))
    assert "--rig 'my rig' --calibration cal --preset" in spec.command()
    assert hash(Calibrated(Demo("office"), "cal")) == hash(Calibrated(Demo("office"), "cal"))


@pytest.mark.parametrize(
    ("spoil", "sentence"),
    [
        (
            lambda cal: (cal / "node_01").rename(cal / "node_07"),
            "is of node_07, and the rig has node_00, node_01",
        ),
        (lambda cal: (cal / "node_01" / "pose.txt").unlink(), "poses of node_00 but none of node_01"),
        (
            lambda cal: [(cal / name).rename(cal / f"x{name}") for name in ("node_00", "node_01")],
            "holds no node",
        ),
        (lambda cal: (cal / "node_00" / "intrinsics.json").write_text("{"), "not valid JSON"),
        (lambda cal: (cal / "node_00" / "pose.txt").write_text("1 2 3"), "does not hold 4 x 4 numbers"),
        (
            lambda cal: write_intrinsics(
                cal / "node_00/intrinsics.json", CameraIntrinsics.pinhole(9, 9, 4, 4, 8, 8)
            ),
            "is for 8 x 8 pixels",
        ),
        (
            lambda cal: write_extrinsics(cal / "node_00/extrinsics.json", np.eye(4)),
            "without depth intrinsics",
        ),
        (lambda cal: write_intrinsics(cal / "node_00/depth_intrinsics.json", CAMERA), "without extrinsics"),
    ],
)
def test_a_calibration_that_does_not_fit_says_so(rig, calibration, spoil, sentence):
    spoil(calibration)
    with pytest.raises(InputError, match=sentence):
        load_rig(rig, calibration)


def test_no_folder_says_so(rig, tmp_path):
    with pytest.raises(InputError, match="nowhere does not exist"):
        load_rig(rig, tmp_path / "nowhere")


def test_depth_of_a_camera_of_its_own_is_registered_when_the_rig_is_opened(tmp_path):
    """A plane 2 m before the depth camera, which stands 5 cm behind the colour camera."""
    node = tmp_path / "rig" / "node_00"
    write_color(node / "color.png", RNG.integers(0, 256, (24, 32, 3), dtype=np.uint8))
    write_depth_mm(node / "depth.png", DepthMap(np.full((12, 16), 2.0, np.float32)))
    write_intrinsics(node / "intrinsics.json", CameraIntrinsics.pinhole(30.0, 30.0, 15.5, 11.5, 32, 24))
    write_intrinsics(node / "depth_intrinsics.json", CameraIntrinsics.pinhole(14.0, 14.0, 7.5, 5.5, 16, 12))
    write_extrinsics(node / "extrinsics.json", rigid(np.eye(3), np.array([0.0, 0.0, -0.05])))
    frame = load_rig(tmp_path / "rig").frames[0]
    assert frame.depth.z_m.shape == (24, 32)
    assert frame.depth.coverage > 0.9
    np.testing.assert_allclose(frame.depth.z_m[frame.depth.valid], 1.95, atol=1e-6)
    (node / "extrinsics.json").write_text(json.dumps({"T_color_depth": (1000 * np.eye(4)).tolist()}))
    with pytest.raises(InputError, match="is not a rigid transform: its last line is 0 0 0 1000"):
        load_rig(tmp_path / "rig")
    write_extrinsics(node / "extrinsics.json", rigid(np.eye(3), np.array([0.0, 0.0, -50.0])))
    with pytest.raises(InputError, match="sees nothing of the depth image"):
        load_rig(tmp_path / "rig")


def test_extrinsics_survive_their_file(tmp_path):
    T = rigid(rotation_exp(np.array([0.1, -0.2, 0.3])), np.array([0.05, 0.0, -0.001]))
    write_extrinsics(tmp_path / "e.json", T)
    np.testing.assert_array_equal(read_extrinsics(tmp_path / "e.json"), T)


@pytest.mark.parametrize("text", ["{", "[]", '{"T_color_depth": [[1, 0], [0, 1]]}', '{"T_color_depth": "x"}'])
def test_other_extrinsics_are_refused(tmp_path, text):
    (tmp_path / "e.json").write_text(text)
    with pytest.raises(InputError, match=r"is not 4 x 4 finite numbers|JSON"):
        read_extrinsics(tmp_path / "e.json")


def test_the_demos_hold_no_calibration_files():
    assert not list(SCENES.glob("*/node_*/depth_correction.json"))
