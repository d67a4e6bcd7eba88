"""Where one looks at a scene from: everything that the cameras saw is in view."""

import numpy as np
import pytest

from app.drawing.cameras import HALF_VIEW, stage_around
from pipeline.kernels.geometry import apply, inverse, look_at

ROOM_M = np.array([4.0, 3.0, 2.4])


def room(count=4000):
    """Points on the walls and the floor of a room around the origin."""
    points_m = np.random.default_rng(0).uniform(-0.5, 0.5, (count, 3)) * ROOM_M
    side = np.arange(count) % 3
    for axis in range(2):
        rows = side == axis
        points_m[rows, axis] = np.sign(points_m[rows, axis]) * 0.5 * ROOM_M[axis]
    points_m[side == 2, 2] = -0.5 * ROOM_M[2]
    return points_m


def looking_around(count=12):
    angles = 2.0 * np.pi * np.arange(count) / count
    return [look_at(np.zeros(3), np.array([np.cos(a), np.sin(a), -0.2])) for a in angles]


def stage_of(points_m, poses):
    return stage_around([apply(inverse(pose), points_m) for pose in poses], poses)


def share_in_view(stage, points_m):
    """Share of points inside a square view with the browser's vertical angle, less its margin."""
    own_m = (points_m - stage.viewpoint_m) @ look_at(stage.viewpoint_m, stage.middle_m)[:3, :3]
    slopes = np.abs(own_m[:, :2]) / own_m[:, 2:]
    return np.mean((own_m[:, 2] > 0.0) & (slopes.max(axis=1) <= HALF_VIEW))


@pytest.mark.parametrize("turn", [0.0, 1.0, 2.5])
def test_a_room_around_its_cameras_is_seen_from_above_and_fits(turn):
    spin = np.array([[np.cos(turn), -np.sin(turn), 0.0], [np.sin(turn), np.cos(turn), 0.0], [0.0, 0.0, 1.0]])
    points_m = room() @ spin.T
    stage = stage_of(points_m, looking_around())
    assert share_in_view(stage, points_m) > 0.95
    assert stage.viewpoint_m[2] > points_m[:, 2].max()
    away_m = np.linalg.norm(stage.viewpoint_m - stage.middle_m)
    assert away_m < 3.0 * np.linalg.norm(ROOM_M)


def test_cameras_that_look_one_way_are_seen_from_behind():
    places_m = [np.array([x, -3.0, 1.0]) for x in (-0.5, 0.0, 0.5)]
    stage = stage_of(room(), [look_at(place_m, np.zeros(3)) for place_m in places_m])
    assert stage.viewpoint_m[1] < -3.0
    assert abs(stage.viewpoint_m[0]) < 0.1
