"""Poses that come with a recording, in all the ways that programs write them."""

from dataclasses import dataclass, replace

import numpy as np
import pytest

from packetmesh.progress import drain
from pipeline.kernels.geometry import inverse, rigid
from pipeline.recording.errors import ate_m
from pipeline.recording.given import CONVENTIONS, checked_poses
from pipeline.recording.walk import iterate_walk
from tests.pipeline.recording.rendered import Rendered, around, in_the_living_room, moved

OPENGL = np.diag([1.0, -1.0, -1.0, 1.0])
FORWARD_LEFT_UP = np.array([[0.0, 0, 1, 0], [-1, 0, 0, 0], [0, -1, 0, 0], [0, 0, 0, 1]])
"""Maps a point in the camera's axes (right, down, forward) to a body's."""
WRITTEN = {
    "from camera to world": lambda T: T,
    "from camera to world with OpenGL's axes": lambda T: T @ OPENGL,
    "from camera to world with the axes of a body in ROS": lambda T: T @ inverse(FORWARD_LEFT_UP),
    "from world to camera": inverse,
    "from world to camera with OpenGL's axes": lambda T: inverse(T @ OPENGL),
}


@dataclass(frozen=True)
class Written(Rendered):
    """A recording with poses as some program has written them."""

    poses: tuple[np.ndarray, ...] = ()

    @property
    def T_world_camera(self):
        return self.poses


def written(poses, **options):
    truth = around(40)
    walk = in_the_living_room(truth, noise_m=0.001)
    return Written(walk.vertices_m, walk.triangles, truth, noise_m=0.001, poses=tuple(poses), **options)


@pytest.mark.parametrize("convention", list(CONVENTIONS))
@pytest.mark.parametrize("beside", [None, moved([0, 1, 0], 1.0, [0.03, 0.0, 0.0])])
def test_every_convention_is_found_and_said(convention, beside):
    truth = around(40)
    given = checked_poses(written([WRITTEN[convention](T) for T in truth], T_color_depth=beside))
    for T, true in zip(given.T_world_camera, truth, strict=True):
        np.testing.assert_allclose(T, true, atol=1e-9)
    expected = convention == "from camera to world"
    assert (given.notes == ()) == expected
    assert expected or convention in given.notes[0]


def enlarged(T, factor):
    return rigid(T[:3, :3], factor * T[:3, 3])


@pytest.mark.parametrize("convention", list(CONVENTIONS))
def test_centimetres_are_found_in_every_convention(convention):
    truth = around(40)
    given = checked_poses(written([enlarged(WRITTEN[convention](T), 100.0) for T in truth]))
    for T, true in zip(given.T_world_camera, truth, strict=True):
        np.testing.assert_allclose(T, true, atol=1e-9)
    assert "in centimetres: they were read so" in given.notes[0]
    assert ("as from" in given.notes[0]) == (convention != "from camera to world")


def test_positions_by_another_factor_are_not_used_and_the_factor_is_named():
    given = checked_poses(written([enlarged(T, 5.0) for T in around(40)]))
    assert given.T_world_camera is None
    assert "moves 5 times as far as the depth shows" in given.notes[0]
    assert "--depth-scale" in given.notes[0]


def test_poses_that_drift_are_kept():
    truth = around(40)
    drifting = [moved([0, 0, 1], 0.2 * k, [0.003 * k, 0, 0]) @ T for k, T in enumerate(truth)]
    given = checked_poses(written(drifting))
    assert given.notes == ()
    np.testing.assert_array_equal(given.T_world_camera, drifting)


def test_poses_of_another_recording_are_not_used_and_the_walk_goes_on():
    truth = around(40)
    recording = written([moved([0, 1, 0], 15.0 * k, [0.2 * k, 0, 0]) for k in range(40)])
    given = checked_poses(recording)
    assert given.T_world_camera is None
    assert "contradict its depth" in given.notes[0]
    rig = drain(iterate_walk(recording))
    assert ate_m(rig.walk.T_world_camera, truth) < 0.003
    assert any("contradict its depth" in note for note in rig.notes)


def test_a_camera_that_stands_says_nothing_about_its_poses():
    still = replace(written([np.eye(4)] * 12), T_true=around(40)[:1] * 12)
    given = checked_poses(still)
    assert "were not compared with its depth" in given.notes[0]
    assert given.T_world_camera == still.poses


def test_poses_that_stand_still_contradict_a_camera_that_moves():
    given = checked_poses(written([np.eye(4)] * 40))
    assert given.T_world_camera is None
    assert "contradict its depth" in given.notes[0]


def test_a_recording_without_poses_has_none():
    assert checked_poses(in_the_living_room(around(6))).T_world_camera is None


def test_poses_of_some_frames_are_compared_and_begin_the_others():
    """Every third frame has a pose, OpenGL's; the first one has none."""
    truth = around(40)
    some = [T @ OPENGL if k % 3 == 1 else None for k, T in enumerate(truth)]
    recording = written(some)
    given = checked_poses(recording)
    assert [T is not None for T in given.T_world_camera] == [k % 3 == 1 for k in range(40)]
    np.testing.assert_allclose(given.T_world_camera[1], truth[1], atol=1e-9)
    assert "OpenGL" in given.notes[0]
    walk = drain(iterate_walk(recording)).walk
    for T, true in zip(walk.T_world_camera, truth, strict=True):
        np.testing.assert_allclose(T, true, atol=0.01)
    assert any("given poses by 0." in note for note in walk.notes)


def test_a_jump_is_not_followed_by_poses_that_are_missing_there():
    """Poses of the frames before the jump say nothing about it: a part begins that colours do not join."""
    truth = around(30)
    away = [
        truth[14] @ moved([0, 1, 0], 170.0, [0, 0, 0]) @ moved([0, 1, 0], 1.0 * k, [0, 0, 0])
        for k in range(10)
    ]
    some = [*truth[:15], *[None] * 10]
    recording = replace(written(some), T_true=[*truth[:15], *away])
    walk = drain(iterate_walk(recording)).walk
    assert all(T is not None for T in walk.T_world_camera[:15])
    assert all(T is None for T in walk.T_world_camera[15:])
    assert ate_m(walk.T_world_camera, recording.T_true) < 0.005


def test_a_path_says_how_far_it_is_from_the_given_poses():
    """Every other pose is 1 cm up and every other one 1 cm down."""
    truth = around(40)
    shaken = [moved([0, 0, 1], 0.0, [0, 0, 0.01 * (-1) ** k]) @ T for k, T in enumerate(truth)]
    rig = drain(iterate_walk(written(shaken)))
    assert any("differs from that of the given poses by 1.0 cm" in note for note in rig.notes)
