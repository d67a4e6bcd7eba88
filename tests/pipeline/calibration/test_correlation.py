"""Which numbers go together, beside what repeated calibrations say."""

import numpy as np
import pytest

from pipeline.calibration.board import Board
from pipeline.calibration.correlation import DISTANCE, correlations
from pipeline.calibration.estimate import View, calibrate
from pipeline.calibration.lens import Optics
from tests.pipeline.calibration.test_trust import SIZE, board_poses
from tests.pipeline.calibration.views import CAMERA

BOARD = Board("circles", 7, 5, 0.05)
TRIALS = 150


def views_of(seed, count=6):
    optics, rng = Optics("thesis", CAMERA.matrix, CAMERA.distortion), np.random.default_rng(seed)
    return [
        View(str(row), optics.project(BOARD.points_m, T) + rng.normal(0.0, 0.1, (35, 2)), BOARD.points_m)
        for row, T in enumerate(board_poses(count))
    ]


def test_what_goes_together_is_what_goes_together_from_trial_to_trial():
    found = []
    for seed in range(TRIALS):
        lens = calibrate(views_of(seed), SIZE)
        away_m = np.mean([np.linalg.norm(view.T_camera_board[:3, 3]) for view in lens.views])
        found.append([*(lens.parameters[name] for name in lens.names), away_m])
    told = correlations(lens)
    assert told.names == (*lens.names, DISTANCE)
    assert np.allclose(np.diag(told.matrix), 1.0)
    assert np.allclose(told.matrix, told.matrix.T)
    assert np.abs(told.matrix - np.corrcoef(np.array(found).T)).max() < 0.3
    focal = told.names.index("fx"), told.names.index(DISTANCE)
    assert told.matrix[focal] == pytest.approx(np.corrcoef(np.array(found).T)[focal], abs=0.08)


def test_the_strongest_pair_is_the_largest_off_the_diagonal():
    told = correlations(calibrate(views_of(0), SIZE))
    pair = told.strongest
    at = told.names.index(pair.first), told.names.index(pair.second)
    assert at[0] < at[1]
    assert told.matrix[at] == pair.correlation
    assert abs(pair.correlation) == np.abs(told.matrix - np.eye(len(told.names))).max()


def test_a_fisheye_has_its_correlations_too():
    lens = calibrate(views_of(0, 8), SIZE, "fisheye")
    told = correlations(lens)
    assert told.matrix.shape == (9, 9)
    assert np.isfinite(told.matrix).all()
