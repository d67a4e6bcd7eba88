"""Rigs in random rooms."""

import numpy as np
import pytest

from lab.between_cameras.rigs import rig_named, room_seeds, wrong_poses
from lab.training.dataset import FIRST_SEED
from pipeline.kernels.geometry import rotation_angle_rad


@pytest.mark.slow
def test_three_cameras_look_at_one_place_of_a_test_room():
    (seed,) = room_seeds("test", 1)
    assert seed >= FIRST_SEED["test"]
    rig = rig_named(f"room-{seed}")
    assert len(rig.frames) == 3
    first = rig.frames[0].T_world_camera
    for frame, true in zip(rig.frames, rig.truth.depth, strict=True):
        assert 0.3 < frame.depth.coverage < 0.98
        measured = frame.depth.valid
        assert np.median(np.abs(frame.depth.z_m - true.z_m)[measured]) < 0.02
        assert first[:3, 2] @ frame.T_world_camera[:3, 2] > np.cos(np.radians(60.0))
    wrong = wrong_poses(rig, 2.0, 0.05)
    np.testing.assert_array_equal(wrong[0], first)
    for T, frame in zip(wrong[1:], rig.frames[1:], strict=True):
        assert np.linalg.norm((T - frame.T_world_camera)[:3, 3]) == pytest.approx(0.05)
        turn = rotation_angle_rad(T[:3, :3].T @ frame.T_world_camera[:3, :3])
        assert turn == pytest.approx(np.radians(2.0))
