"""The proposed view against others, by what it really does to simulated calibrations."""

import numpy as np

from pipeline.calibration.board import Board
from pipeline.calibration.estimate import View, calibrate, settle
from pipeline.calibration.lens import Optics
from pipeline.calibration.next_view import candidates, next_view
from pipeline.calibration.trust import sight
from pipeline.kernels.geometry import apply
from tests.pipeline.calibration.test_trust import BOARD, SIZE, board_poses
from tests.pipeline.calibration.views import CAMERA

TRUTH = Optics("thesis", CAMERA.matrix, CAMERA.distortion)


def seen(T, rng, noise_px=0.2):
    return View("", TRUTH.project(BOARD.points_m, T) + rng.normal(0.0, noise_px, (35, 2)), BOARD.points_m)


def error_m(poses, seeds=12, range_m=2.0):
    """Of points at the range, over the image and over calibrations, with the camera placed by its boards."""
    grid = sight(TRUTH, SIZE, range_m)
    boards_m = np.concatenate([apply(T, BOARD.points_m) for T in poses[:4]])
    boards_px = TRUTH.project(boards_m)
    squares = []
    for seed in range(seeds):
        rng = np.random.default_rng(seed)
        found = calibrate([seen(T, rng) for T in poses], SIZE)
        placed = settle(boards_m, boards_px, np.eye(4), found.optics)
        off_px = found.optics.project(grid.points_m, placed) - TRUTH.project(grid.points_m)
        squares.append(np.mean(((grid.metres @ off_px[:, :, None]) ** 2).sum(axis=1)))
    return float(np.sqrt(np.mean(squares)))


def test_it_lowers_the_error_more_than_most_other_views():
    poses = board_poses(4)
    rng = np.random.default_rng(0)
    found = calibrate([seen(T, rng) for T in poses], SIZE)
    following = next_view(found, BOARD, 2.0)
    others = list(candidates(BOARD, found.optics, SIZE))
    some = [others[row] for row in np.random.default_rng(1).choice(len(others), 11, replace=False)]
    before, after = error_m(poses), error_m([*poses, following.T_camera_board])
    assert after < np.median([error_m([*poses, T]) for T in some])
    assert after < 0.8 * before
    assert following.error_after_m < following.error_before_m


def test_candidates_are_the_same_every_time_and_wholly_in_the_image():
    many = [list(candidates(BOARD, TRUTH, SIZE)) for _ in range(2)]
    np.testing.assert_array_equal(*many)
    assert len(many[0]) > 100
    for T in many[0]:
        points_px = TRUTH.project(BOARD.points_m, T)
        assert ((points_px >= 0.0) & (points_px <= np.array(SIZE) - 1.0)).all()


def test_it_tells_where_and_how_to_hold_the_board():
    rng = np.random.default_rng(0)
    found = calibrate([seen(T, rng) for T in board_poses(6)], SIZE)
    told = next_view(found, BOARD, 2.0)
    np.testing.assert_allclose(told.points_px, found.optics.project(BOARD.points_m, told.T_camera_board))
    np.testing.assert_array_equal(told.outline_px[[0, 2]], told.points_px[[0, -1]])
    assert 0.0 <= told.tilt_deg <= 60.0
    assert 0.1 < told.distance_m < 3.0


def test_a_board_of_another_spacing_is_held_farther_away():
    rng = np.random.default_rng(0)
    found = calibrate([seen(T, rng) for T in board_poses(6)], SIZE)
    small, large = (next_view(found, Board("circles", 7, 5, pitch_m), 2.0) for pitch_m in (0.05, 0.1))
    assert large.distance_m > 1.3 * small.distance_m
