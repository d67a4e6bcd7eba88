"""Which frames make a rig."""

import numpy as np
import pytest

from pipeline.importing.choosing import LEAST_OVERLAP, apart_but_overlapping, choose, overlaps
from pipeline.importing.sequence import Candidate, Sequence
from pipeline.kernels.geometry import look_at
from tests.pipeline.importing.recordings import CAMERA, orbit


def recording(poses) -> Sequence:
    """Its files do not exist, so none of them can be read."""
    names = "nowhere/color.png", "nowhere/depth.png"
    return Sequence(tuple(Candidate(*names, T) for T in poses), CAMERA)


def orbit_poses(count: int, step_deg: float) -> np.ndarray:
    return np.array([frame.T_world_camera for frame in orbit(count, step_deg=step_deg).frames])


def test_overlap_of_a_view_with_itself_is_whole_and_with_one_that_looks_away_nothing():
    T = look_at((0.0, 0.0, 0.0), (0.0, 1.0, 0.0))
    away = look_at((0.0, 0.0, 0.0), (0.0, -1.0, 0.0))
    np.testing.assert_allclose(overlaps(np.array([T, away]), CAMERA, 2.0), np.eye(2), atol=1e-12)


def test_overlap_falls_with_the_angle_and_is_symmetric():
    shared = overlaps(orbit_poses(10, 12.0), CAMERA, 2.0)
    np.testing.assert_allclose(shared, shared.T)
    assert (np.diff(shared[0]) <= 0.0).all()
    assert shared[0, -1] < LEAST_OVERLAP < shared[0, 1]


def test_chosen_frames_overlap_by_half_and_are_farther_apart_than_neighbours():
    poses = orbit_poses(90, 1.0)
    chosen = choose(recording(poses), 3, 2.0)
    shared = overlaps(poses, CAMERA, 2.0)[np.ix_(chosen, chosen)] - np.eye(3)
    assert (shared.max(axis=0) >= LEAST_OVERLAP).all()
    assert np.diff(chosen).min() >= 10
    assert list(chosen) == sorted(set(chosen))


def test_a_view_of_another_place_is_never_chosen():
    poses = list(orbit_poses(6, 3.0))
    poses[2] = look_at((50.0, 0.0, 0.0), (60.0, 0.0, 0.0))  # another room
    assert 2 not in choose(recording(poses), 5, 2.0)


def test_no_more_frames_than_overlap():
    shared = np.eye(4)
    assert len(apart_but_overlapping(shared, 3)) == 1


@pytest.mark.parametrize("count", [2, 3, 6])
def test_without_poses_frames_spread_over_the_recording(count):
    chosen = choose(recording([None] * 601), count, 2.0)
    assert chosen[0] == 0
    assert chosen[-1] == 600
    assert np.ptp(np.diff(chosen)) <= 1


def test_a_short_recording_is_taken_whole():
    assert choose(recording([None] * 2), 3, 2.0) == (0, 1)


def test_a_long_recording_is_chosen_from_in_seconds():
    poses = np.tile(np.eye(4), (10_000, 1, 1))
    poses[:, 0, 3] = np.linspace(0.0, 20.0, 10_000)
    chosen = choose(recording(poses), 6, 2.0)
    assert len(chosen) == 6
