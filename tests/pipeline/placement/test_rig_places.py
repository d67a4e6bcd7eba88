"""A rig finds its places or says which node did not; nothing is piled on."""

from dataclasses import replace

import numpy as np
import pytest

from packetmesh.progress import drain
from pipeline.config import PRESETS, PipelineConfig
from pipeline.folders.run import metrics_of
from pipeline.io.demos import load_demo
from pipeline.io.rigs import load_rig, save_rig
from pipeline.kernels.geometry import LEVEL_POSE, inverse, pixel_rays, rigid, rotation_exp
from pipeline.reconstruct import reconstruct
from pipeline.registration import rotation_error_rad
from pipeline.sources import LoadedRig
from pipeline.spec import Spec
from pipeline.stages import RunCache, run
from pipeline.types import CameraIntrinsics, DepthMap, RgbdFrame, Rig

pytestmark = pytest.mark.xdist_group("reconstruct")


def lost(frame: RgbdFrame, name: str | None = None) -> RgbdFrame:
    """The frame of a node about whose pose nothing is known."""
    return replace(frame, name=name or frame.name, T_world_camera=LEVEL_POSE.copy(), pose_known=False)


def placed(*frames: RgbdFrame, config: PipelineConfig = PRESETS["packetmesh"]):
    spec = Spec(LoadedRig(Rig("rig", frames)), config=config)
    return drain(run(spec, RunCache(), ["placement"]))["placement"].value


@pytest.fixture(scope="module")
def room():
    return load_demo("living-room")


def test_a_stranger_with_a_plausible_pose_is_doubted(room):
    """Two rooms are alike enough that registration fits wall on wall: it is not believed, and said."""
    first, second, third = room.frames
    stranger = replace(load_demo("office").frames[0], name="stranger", T_world_camera=third.T_world_camera)
    (sentence,) = placed(first, second, stranger).sentences
    assert sentence.startswith("stranger agrees badly with the others")


def test_a_given_pose_beyond_the_gate_is_corrected_by_a_wider_one(room):
    first, second, third = room.frames
    aside = rigid(rotation_exp(np.radians([0.0, 15.0, 0.0])), np.zeros(3))
    placement = placed(first, second, replace(third, T_world_camera=third.T_world_camera @ aside))
    assert placement.sentences == []
    check_relative_poses(placement.T_world_camera, room.truth.T_world_camera)


@pytest.mark.parametrize(
    "normals",
    [[(0.0, 0.0, 1.0)], [(1.0, 0.0, 1.0), (-1.0, 0.0, 1.0)]],
    ids=["one wall", "two walls"],
)
def test_views_of_walls_alone_do_not_place_a_node(normals):
    """Bare walls agree wherever one slides along them."""
    placement = placed(walls("one", normals, 0.0), walls("other", normals, 0.05))
    assert placement.placed(["one", "other"]) == ["one"]
    assert "hardly determine the pose in one direction" in placement.sentences[0]


def walls(name: str, normals, turn_rad: float) -> RgbdFrame:
    """What a camera measures of planes 2 m away, seen a little from the side, with a Kinect's noise."""
    camera, rng = CameraIntrinsics.pinhole(262.0, 262.0, 159.5, 119.5, 320, 240), np.random.default_rng(0)
    rays = pixel_rays(camera) @ rotation_exp(np.array([0.0, turn_rad, 0.0])).T
    along = rays @ (np.array(normals) / np.linalg.norm(normals, axis=1, keepdims=True)).T
    z_m = np.min(np.where(along > 0.0, 2.0 / along, np.inf), axis=-1)
    z_m += 0.0012 * z_m**2 * rng.standard_normal(z_m.shape)
    rgb = np.full((240, 320, 3), 128, np.uint8)
    depth = DepthMap(z_m.astype(np.float32))
    return RgbdFrame(name, rgb, depth, camera, LEVEL_POSE.copy(), pose_known=False)


def check_relative_poses(poses, true, turn_deg=2.0, shift_m=0.05):
    for pose, true_pose in zip(poses[1:], true[1:], strict=True):
        T, T_true = inverse(poses[0]) @ pose, inverse(true[0]) @ true_pose
        assert np.degrees(rotation_error_rad(T, T_true)) < turn_deg
        assert np.linalg.norm(T[:3, 3] - T_true[:3, 3]) < shift_m


def test_a_rig_without_poses_comes_out_right(room):
    placement = placed(*map(lost, room.frames))
    assert placement.sentences == []
    assert placement.agreement.within_2pct_share > 0.9
    np.testing.assert_array_equal(placement.T_world_camera[0], LEVEL_POSE)
    check_relative_poses(placement.T_world_camera, room.truth.T_world_camera)


def test_nodes_with_poses_keep_their_world_when_the_first_has_none(room):
    placement = placed(lost(room.frames[0]), *room.frames[1:])
    np.testing.assert_array_equal(placement.T_world_camera[1], room.frames[1].T_world_camera)
    check_relative_poses(placement.T_world_camera, room.truth.T_world_camera)


def test_a_rig_folder_without_pose_files_knows_that_it_does_not_know(tmp_path, room):
    save_rig(tmp_path / "rig", replace(room, truth=None))
    (tmp_path / "rig" / "node_01" / "pose.txt").unlink()
    rig = load_rig(tmp_path / "rig")
    assert [frame.pose_known for frame in rig.frames] == [True, False, True]
    save_rig(tmp_path / "copy", rig)
    assert not (tmp_path / "copy" / "node_01" / "pose.txt").exists()


def test_the_camera_of_another_room_is_left_out_even_if_it_comes_first(room):
    """Rooms are alike: wall on wall, most points have neighbours within centimetres."""
    first, second = room.frames[:2]
    stranger = lost(load_demo("office").frames[0], "stranger")
    placement = placed(stranger, lost(first), lost(second))
    assert placement.placed(["stranger", "first", "second"]) == ["first", "second"]
    (sentence,) = placement.sentences
    assert sentence.startswith("stranger is left out: its pose is not known")
    check_relative_poses(placement.T_world_camera[1:], room.truth.T_world_camera[:2])


def test_what_a_node_with_a_wrong_pose_measured_is_not_piled_onto_the_rest(room):
    first, second, third = room.frames
    aside = rigid(rotation_exp(np.radians([0.0, 30.0, 0.0])), np.array([0.8, 0.0, 0.0]))
    wrong = replace(third, name="wrong", T_world_camera=third.T_world_camera @ aside)
    result = reconstruct(Rig("rig", (first, second, wrong)))
    metrics = metrics_of(result)
    assert [node["place"]["placed"] for node in metrics["nodes"]] == [True, True, False]
    assert list(metrics["poses"]) == [first.name, second.name]
    assert "wrong is left out: of what it and the others both measured" in result.placement.sentences[0]
    assert metrics["measured"]["agreement_between_nodes"] > 0.9
    pair = reconstruct(Rig("pair", (first, second)))
    assert result.after.vertices_m.tobytes() == pair.after.vertices_m.tobytes()
    assert result.after.quality == pair.after.quality
