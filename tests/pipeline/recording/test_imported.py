"""Poses that contradict the depth, on import."""

import numpy as np
import pytest

from lab.walks.walk import kinect, read_truth, render_walk
from lab.worlds.rooms import random_room
from packetmesh.progress import drain
from pipeline.importing.tum import poses_at
from pipeline.io.poses import write_tum
from pipeline.io.rigs import load_rig
from pipeline.kernels.geometry import inverse
from pipeline.recording.imported import iterate_checked_import, iterate_checked_keep

OPENGL = np.diag([1.0, -1.0, -1.0, 1.0])
TIMES_S = np.arange(24) / 30.0


@pytest.fixture(scope="module")
def walk(tmp_path_factory):
    folder = tmp_path_factory.mktemp("recordings") / "walk"
    render_walk(random_room(5_000_001), len(TIMES_S), kinect(160), folder)
    return folder


def posed(walk, folder, poses):
    """Return a copy of a recording with poses."""
    folder.mkdir()
    for name in ("rgb", "depth", "rgb.txt", "depth.txt", "intrinsics.json"):
        (folder / name).symlink_to(walk / name)
    write_tum(folder / "groundtruth.txt", TIMES_S, poses)
    return folder


def test_poses_of_a_rig_have_the_axes_that_agree_with_the_depth(walk, tmp_path):
    truth = read_truth(walk).T_world_camera
    expected = drain(iterate_checked_import(posed(walk, tmp_path / "cv", truth), tmp_path / "cv_rig"))
    opengl = posed(walk, tmp_path / "gl", [T @ OPENGL for T in truth])
    report = drain(iterate_checked_import(opengl, tmp_path / "gl_rig"))
    assert any("only if read as from camera to world with OpenGL's axes" in note for note in report.notes)
    assert not any("turned so that z is up" in note for note in report.notes)
    assert [one.time_s for one in report.frames] == [one.time_s for one in expected.frames]
    rigs = (load_rig(tmp_path / name).frames for name in ("cv_rig", "gl_rig"))
    for one, other in zip(*rigs, strict=True):
        np.testing.assert_allclose(one.T_world_camera, other.T_world_camera, atol=1e-5)


def test_poses_that_contradict_the_depth_are_left_out_of_the_rig(walk, tmp_path):
    wrong = [inverse(T) for T in read_truth(walk).T_world_camera[::-1]]
    report = drain(iterate_checked_import(posed(walk, tmp_path / "wrong", wrong), tmp_path / "rig"))
    assert any("contradict its depth" in note for note in report.notes)
    assert not any(frame.pose_known for frame in load_rig(tmp_path / "rig").frames)
    assert not any("overlap by half" in note for note in report.notes)


def test_all_frames_are_written_with_the_poses_that_agree(walk, tmp_path):
    truth = read_truth(walk).T_world_camera
    opengl = posed(walk, tmp_path / "gl", [T @ OPENGL for T in truth])
    report = drain(iterate_checked_keep(opengl, tmp_path / "kept"))
    assert any("OpenGL's axes" in note for note in report.notes)
    poses = poses_at(tmp_path / "kept" / "groundtruth.txt", TIMES_S)
    np.testing.assert_allclose([poses[k] for k in range(len(truth))], truth, atol=1e-5)
