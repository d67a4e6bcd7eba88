"""The ceiling of a room that cameras saw, and the rooms in which there is none."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from app.looking.room import BELOW_M, ceiling_of, room_of
from pipeline.kernels.geometry import LEVEL_POSE, look_at

RNG = np.random.default_rng(4)
CAMERA_M = 1.5


def sheet(low_m, high_m, count=20_000, noise_m=0.01):
    """Points spread over a box, which may be flat."""
    points_m = RNG.uniform(low_m, high_m, (count, 3))
    return points_m + RNG.normal(0.0, noise_m, points_m.shape)


FLOOR = sheet((0, 0, 0), (4, 4, 0))
WALLS = np.concatenate([sheet((0, 0, 0), (0, 4, 2.6)), sheet((0, 4, 0), (4, 4, 2.6))])
CEILING = sheet((0, 0, 2.6), (3, 4, 2.6))


def test_the_ceiling_is_found_and_the_cut_is_below_it():
    height_m = ceiling_of(np.concatenate([FLOOR, WALLS, CEILING]), CAMERA_M)
    assert 2.6 - BELOW_M - 0.06 < height_m < 2.6 - BELOW_M + 0.02


def test_points_outside_a_window_do_not_raise_it():
    outside = sheet((4, 0, 2.0), (8, 4, 6.0), 1000)
    height_m = ceiling_of(np.concatenate([FLOOR, WALLS, CEILING, outside]), CAMERA_M)
    assert height_m == pytest.approx(2.6 - BELOW_M, abs=0.06)


@pytest.mark.parametrize(
    "points_m",
    [
        FLOOR,
        np.concatenate([FLOOR, WALLS]),
        np.concatenate([FLOOR, WALLS, sheet((1, 1, 2.0), (1.9, 1.9, 2.0))]),  # a lamp's shade
        np.concatenate([FLOOR, WALLS, sheet((0, 0, 1.3), (3, 3, 1.3))]),  # a table below the cameras
    ],
    ids=["floor", "walls", "lamp", "table"],
)
def test_without_a_ceiling_none_is_found(points_m):
    assert ceiling_of(points_m, CAMERA_M) is None


def view(points_m, pose):
    """A scene of one camera, in whose frame the points are given in the world."""
    local_m = (points_m - pose[:3, 3]) @ pose[:3, :3]
    return SimpleNamespace(
        nodes=[SimpleNamespace(T_world_camera=pose, sensor=SimpleNamespace(points_m=local_m))]
    )


def test_a_room_is_as_large_as_what_was_seen_in_the_world():
    pose = look_at(np.array([2.0, 1.0, CAMERA_M]), np.array([2.0, 3.0, 1.2]))
    room = room_of(view(np.concatenate([FLOOR, WALLS, CEILING]), pose))
    assert room.upright
    assert room.ceiling_m == pytest.approx(2.6 - BELOW_M, abs=0.06)
    assert room.centre_m == pytest.approx([2.0, 2.0, 1.3], abs=0.1)
    assert room.size_m == pytest.approx([4.0, 4.0, 2.6], abs=0.15)
    assert replace(room, low_m=room.high_m).size_m.min() > 0.0


def test_a_camera_without_a_pose_does_not_say_which_way_is_up():
    room = room_of(view(np.concatenate([FLOOR, WALLS, CEILING]) - [2.0, 1.0, CAMERA_M], LEVEL_POSE))
    assert not room.upright
    assert room.ceiling_m is None
