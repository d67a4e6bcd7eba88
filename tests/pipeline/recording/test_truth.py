"""The sentence on the true path: known errors, and nothing where there is no walk."""

from dataclasses import replace

import numpy as np
import pytest

from pipeline.io.poses import write_tum
from pipeline.kernels.geometry import rigid, rotation_exp
from pipeline.recording.truth import with_true_path
from pipeline.types import PointCloud, Rig, Walk

COUNT = 20
ANGLES = np.linspace(0.0, 2.0 * np.pi, COUNT, endpoint=False)


def circle(radius_m):
    return tuple(rigid(np.eye(3), radius_m * np.array([np.cos(a), np.sin(a), 0.0])) for a in ANGLES)


@pytest.fixture
def walk():
    cloud = PointCloud(np.zeros((0, 3)))
    empty = np.zeros(0, int)
    return Walk(np.arange(COUNT) / 10.0, circle(1.0), (0,), (), cloud, 0.01, empty, circle(1.0))


def note_of(walk, file):
    rig = with_true_path(Rig("walk", (), walk=walk), file)
    return rig.walk.notes


def test_a_circle_that_is_too_large_is_off_by_its_excess_wherever_it_lies(walk, tmp_path):
    T = rigid(rotation_exp(np.array([0.3, -0.2, 1.0])), np.array([4.0, 5.0, 6.0]))
    write_tum(tmp_path / "truth.txt", walk.times_s, [T @ pose for pose in circle(1.05)])
    assert note_of(walk, tmp_path / "truth.txt") == (
        "The path differs from the true one by 5.0 cm (RMSE, aligned)",
    )


def test_frames_without_a_pose_or_without_truth_do_not_count(walk, tmp_path):
    write_tum(tmp_path / "truth.txt", walk.times_s[2:], circle(1.0)[2:])
    poses = list(walk.T_world_camera)
    poses[0], poses[5] = rigid(np.eye(3), np.array([9.0, 9.0, 9.0])), None
    lost = replace(walk, T_world_camera=tuple(poses))
    assert note_of(lost, tmp_path / "truth.txt") == (
        "The path differs from the true one by 0.0 cm (RMSE, aligned)",
    )


def test_without_a_walk_or_without_truth_nothing_is_said(walk, tmp_path):
    rig = Rig("rig", ())
    assert with_true_path(rig, tmp_path / "none.txt") is rig
    assert note_of(walk, tmp_path / "none.txt") == ()
