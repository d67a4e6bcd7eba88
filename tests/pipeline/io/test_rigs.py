"""Rig folders: what is saved is loaded, and the nodes' order and poses hold."""

import json
from dataclasses import replace

import cv2
import numpy as np
import pytest

from packetmesh.errors import InputError
from pipeline.io.depth_correction import DepthCorrection, write_depth_correction
from pipeline.io.rigs import load_frame, load_rig, save_rig
from pipeline.kernels.geometry import LEVEL_POSE, look_at
from pipeline.types import CameraIntrinsics, DepthMap, DepthNoise, RgbdFrame, Rig, RigTruth


def small_frame(seed: int) -> RgbdFrame:
    rng = np.random.default_rng(seed)
    z_m = (rng.integers(500, 4000, (12, 16)) / 1000.0).astype(np.float32)
    z_m[rng.random((12, 16)) < 0.2] = np.nan
    return RgbdFrame(
        name=f"node_{seed:02d}",
        rgb=rng.integers(0, 256, (12, 16, 3), dtype=np.uint8),
        depth=DepthMap(z_m),
        intrinsics=CameraIntrinsics.pinhole(14.0, 14.5, 7.5, 5.5, 16, 12),
        T_world_camera=look_at(rng.normal(size=3), rng.normal(size=3)),
    )


def rig_of(count: int) -> Rig:
    return Rig("rig", tuple(small_frame(seed) for seed in range(count)))


def assert_same(first: RgbdFrame, second: RgbdFrame):
    assert first.name == second.name
    np.testing.assert_array_equal(first.rgb, second.rgb)
    np.testing.assert_array_equal(first.depth.z_m, second.depth.z_m)
    np.testing.assert_array_equal(first.intrinsics.matrix, second.intrinsics.matrix)
    np.testing.assert_array_equal(first.T_world_camera, second.T_world_camera)


@pytest.mark.parametrize("count", [1, 3, 6])
def test_what_is_saved_is_loaded_to_the_last_bit(tmp_path, count):
    rig = rig_of(count)
    save_rig(tmp_path / "rig", rig)
    again = load_rig(tmp_path / "rig")
    assert again.name == "rig"
    assert again.truth is None
    assert len(again.frames) == count
    for frame, expected in zip(again.frames, rig.frames, strict=True):
        assert_same(frame, expected)


def test_a_folder_holds_only_what_the_design_says(tmp_path):
    save_rig(tmp_path / "rig", rig_of(1))
    names = sorted(path.name for path in (tmp_path / "rig" / "node_00").iterdir())
    assert names == ["color.png", "depth.png", "intrinsics.json", "pose.txt"]


def test_a_rig_can_be_saved_over_itself(tmp_path):
    save_rig(tmp_path / "rig", rig_of(2))
    save_rig(tmp_path / "rig", Rig("rig", rig_of(2).frames[::-1]))
    np.testing.assert_array_equal(load_rig(tmp_path / "rig").frames[0].rgb, small_frame(1).rgb)


def test_a_saved_rig_replaces_all_of_an_older_one(tmp_path):
    """A camera without a pose and a rig without truth keep neither those of the rig before them."""
    posed = rig_of(1).frames[0]
    surface = np.array([[0.0, 3.0, 0.0], [4.0, 3.0, 0.0], [0.0, 3.0, 4.0]]), np.array([[0, 1, 2]], np.int32)
    lens = CameraIntrinsics.pinhole(15.0, 15.5, 7.5, 5.5, 16, 12)
    truth = RigTruth(*surface, (posed.T_world_camera,), (posed.depth,), (lens,))
    save_rig(tmp_path / "rig", Rig("rig", (posed,), truth))
    assert load_rig(tmp_path / "rig").truth is not None
    save_rig(tmp_path / "rig", Rig("rig", (replace(posed, pose_known=False),)))
    again = load_rig(tmp_path / "rig")
    assert again.truth is None
    assert not again.frames[0].pose_known
    names = sorted(path.relative_to(tmp_path / "rig").as_posix() for path in (tmp_path / "rig").rglob("*.*"))
    assert names == [f"node_00/{name}" for name in ("color.png", "depth.png", "intrinsics.json")]


def test_a_node_without_pose_stands_level(tmp_path):
    """World z is up: the image's down axis (y) must point down, and the camera must look at the horizon."""
    save_rig(tmp_path / "rig", rig_of(1))
    (tmp_path / "rig" / "node_00" / "pose.txt").unlink()
    T = load_rig(tmp_path / "rig").frames[0].T_world_camera
    np.testing.assert_array_equal(T, LEVEL_POSE)
    np.testing.assert_allclose(T[:3, :3] @ [0.0, 1.0, 0.0], [0.0, 0.0, -1.0], atol=1e-15)
    np.testing.assert_allclose(T[:3, :3] @ [0.0, 0.0, 1.0], [0.0, 1.0, 0.0], atol=1e-15)


def test_a_pair_is_a_node(tmp_path):
    save_rig(tmp_path / "rig", rig_of(1))
    folder = tmp_path / "rig" / "node_00"
    frame = load_frame(folder / "color.png", folder / "depth.png", folder / "intrinsics.json", 500.0, "pair")
    assert frame.name == "pair"
    np.testing.assert_allclose(frame.depth.z_m, 2 * small_frame(0).depth.z_m, rtol=1e-6)


def test_a_rig_may_have_another_depth_scale(tmp_path):
    save_rig(tmp_path / "rig", rig_of(2))
    for frame, expected in zip(
        load_rig(tmp_path / "rig", depth_scale=5000.0).frames, rig_of(2).frames, strict=True
    ):
        np.testing.assert_allclose(frame.depth.z_m, expected.depth.z_m / 5.0, rtol=1e-6)


def test_poses_may_have_comments_and_commas(tmp_path):
    save_rig(tmp_path / "rig", rig_of(1))
    pose = "# by hand\n1, 0, 0, 0.5\n0, 1, 0, -1\n\n0, 0, 1, 2\n0, 0, 0, 1\n"
    (tmp_path / "rig" / "node_00" / "pose.txt").write_text(pose)
    expected = np.eye(4)
    expected[:3, 3] = [0.5, -1, 2]
    np.testing.assert_array_equal(load_rig(tmp_path / "rig").frames[0].T_world_camera, expected)


def test_a_corrected_rig_is_written_corrected_and_never_corrected_twice(tmp_path):
    rng = np.random.default_rng(0)
    noise = DepthNoise(0.002, 0.0019, 2.36, 0.5)
    camera = CameraIntrinsics.pinhole(50.0, 50.0, 15.5, 11.5, 32, 24)
    z_m = (np.rint(rng.uniform(900.0, 3000.0, (24, 32))) / 1000.0).astype(np.float32)
    rgb = rng.integers(0, 256, (24, 32, 3), dtype=np.uint8)
    raw = Rig("raw", (RgbdFrame("node_00", rgb, DepthMap(z_m), camera, np.eye(4)),))
    save_rig(tmp_path / "rig", raw)
    write_depth_correction(
        tmp_path / "rig" / "node_00" / "depth_correction.json",
        DepthCorrection((32, 24), scale=1.1, noise=noise),
    )
    corrected = load_rig(tmp_path / "rig")
    np.testing.assert_allclose(corrected.frames[0].depth.z_m, 1.1 * z_m, rtol=1e-6)
    save_rig(tmp_path / "rig", corrected)
    again = load_rig(tmp_path / "rig").frames[0]
    np.testing.assert_allclose(again.depth.z_m, corrected.frames[0].depth.z_m, atol=0.00051)
    assert again.noise == noise
    save_rig(tmp_path / "rig", raw)
    assert load_rig(tmp_path / "rig").frames[0].noise is None


def test_nodes_are_ordered_by_the_numbers_in_their_names(tmp_path):
    save_rig(tmp_path / "rig", rig_of(2))
    for old, new in (("node_00", "node_2"), ("node_01", "node_10")):
        (tmp_path / "rig" / old).rename(tmp_path / "rig" / new)
    assert [frame.name for frame in load_rig(tmp_path / "rig").frames] == ["node_2", "node_10"]


def test_intrinsics_on_their_side_say_so(tmp_path):
    save_rig(tmp_path / "rig", rig_of(1))
    node = tmp_path / "rig" / "node_00"
    K = {"fx": 14, "fy": 14, "cx": 5.5, "cy": 7.5, "width": 12, "height": 16}
    (node / "intrinsics.json").write_text(json.dumps(K))
    with pytest.raises(
        InputError, match="try to turn the image by 90 degrees, or the intrinsics of images of"
    ):
        load_rig(tmp_path / "rig")
    for name in ("color", "depth"):
        image = cv2.imread(str(node / f"{name}.png"), cv2.IMREAD_UNCHANGED)
        cv2.imwrite(str(node / f"{name}.png"), cv2.rotate(image, cv2.ROTATE_90_CLOCKWISE))
    assert load_rig(tmp_path / "rig").frames[0].depth.z_m.shape == (16, 12)
