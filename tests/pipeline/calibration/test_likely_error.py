"""Drawn errors are those that simulated cameras have, whatever is wrong: noise, the lens model, or the
board.
"""

import numpy as np
import pytest

from packetmesh.errors import InputError
from pipeline.calibration.estimate import View, calibrate, settle
from pipeline.calibration.lens import Optics
from pipeline.calibration.likely_error import LikelyError, _bends_m, likely_error
from pipeline.calibration.trust import sight
from pipeline.kernels.geometry import apply
from tests.pipeline.calibration.test_trust import BOARD, SIZE, board_poses, views
from tests.pipeline.calibration.views import CAMERA

RANGE_M = 2.0
TANGENTIAL = [-0.3, 0.15, 0.005, -0.003, 0.0]


def true_error_m(found, true, boards_m):
    """(G,) distances of the true points from the rays of a camera, placed by the true boards."""
    T = settle(boards_m, true.project(boards_m), np.eye(4), found)
    seen = sight(true, SIZE, RANGE_M)
    grid_px = np.stack(np.meshgrid(seen.columns_px, seen.rows_px), axis=-1).reshape(-1, 2)
    return np.linalg.norm(np.cross(apply(T, seen.points_m), found.rays(grid_px)), axis=1)


def of_most(error_m):
    return np.quantile(error_m, 0.95, axis=-1)


def ranks(sessions, lens="thesis", truth=None):
    """The share of draws below the truth, for each session."""
    told = []
    for given, boards_m in sessions:
        found = calibrate(given, SIZE, lens)
        true = of_most(true_error_m(found.optics, truth, boards_m))
        told.append(float((of_most(likely_error(found, RANGE_M).error_m) < true).mean()))
    return np.array(told)


def flat(count):
    return np.concatenate([apply(T, BOARD.points_m) for T in board_poses(count)])


def test_with_the_right_lens_and_a_flat_board_the_truth_is_a_draw_like_others():
    truth = Optics("thesis", CAMERA.matrix, CAMERA.distortion)
    told = ranks([(views(0.3, seed), flat(10)) for seed in range(24)], truth=truth)
    assert 0.3 < told.mean() < 0.7
    assert (told > 0.98).sum() <= 2


def test_with_a_wrong_lens_model_the_truth_is_within_the_draws():
    truth = Optics("brown", CAMERA.matrix, np.array(TANGENTIAL))
    sessions = [(views(0.2, seed, 14, TANGENTIAL), flat(14)) for seed in range(10)]
    assert np.median(ranks(sessions, truth=truth)) < 0.95
    judged = likely_error(calibrate(sessions[0][0], SIZE), RANGE_M)
    assert judged.wrong_lens > 0.99
    right = likely_error(calibrate(sessions[0][0], SIZE, "brown"), RANGE_M)
    assert right.wrong_lens < 0.95
    assert right.of_share_m(0.95, 0.5) < 0.3 * judged.of_share_m(0.95, 0.5)


def bent_views(seed, bend_m, noise_px=0.1, count=12):
    rng = np.random.default_rng((7, seed))
    optics = Optics("thesis", CAMERA.matrix, CAMERA.distortion)
    bent_m = BOARD.points_m.copy()
    bent_m[:, 2] = bend_m * (bent_m[:, 0] / np.abs(bent_m[:, 0]).max()) ** 2
    boards_m = [apply(T, bent_m) for T in board_poses(count)]
    given = [
        View(str(row), optics.project(one) + rng.normal(0.0, noise_px, (35, 2)), BOARD.points_m)
        for row, one in enumerate(boards_m)
    ]
    return given, np.concatenate(boards_m)


def test_a_bent_board_is_noticed_and_its_error_foreseen():
    truth = Optics("thesis", CAMERA.matrix, CAMERA.distortion)
    sessions = [bent_views(seed, 0.002) for seed in range(8)]
    assert np.median(ranks(sessions, truth=truth)) < 0.95
    for given, boards_m in sessions[:3]:
        found = calibrate(given, SIZE)
        judged = likely_error(found, RANGE_M)
        assert judged.bent > 0.99
        assert of_most(true_error_m(found.optics, truth, boards_m)) == pytest.approx(
            judged.of_share_m(0.95, 0.5), rel=0.5
        )
    assert likely_error(calibrate(bent_views(0, 0.0)[0], SIZE), RANGE_M).bent < 0.95


def test_more_noise_makes_larger_errors_in_proportion():
    """Ten times the noise: the same directions of error, ten times as long."""
    near, far = (likely_error(calibrate(views(noise, 0), SIZE), RANGE_M) for noise in (0.05, 0.5))
    assert far.of_share_m(0.95, 0.5) == pytest.approx(10.0 * near.of_share_m(0.95, 0.5), rel=0.3)


@pytest.mark.parametrize("seed", [0, 2, 3, 5])
def test_a_blurred_view_counts_less_than_the_others(seed):
    """One view with 20 times the noise moves the camera, and the nine others know by how much."""
    rng, given = np.random.default_rng(seed), views(0.1, seed)
    blurred = View("x", given[0].points_px + rng.normal(0.0, 2.0, (35, 2)), BOARD.points_m)
    truth = Optics("thesis", CAMERA.matrix, CAMERA.distortion)
    found = calibrate([blurred, *given[1:]], SIZE)
    judged = likely_error(found, RANGE_M)
    low_m, middle_m, high_m = (judged.of_share_m(0.95, level) for level in (0.05, 0.5, 0.95))
    assert of_most(true_error_m(found.optics, truth, flat(10))) == pytest.approx(middle_m, rel=0.2)
    assert high_m < 2.5 * low_m


def test_equal_views_give_equal_draws():
    found = calibrate(views(0.2, 0), SIZE)
    one, other = (likely_error(found, RANGE_M) for _ in range(2))
    np.testing.assert_array_equal(one.error_m, other.error_m)


def test_views_without_any_noise_give_a_camera_that_is_surely_right():
    assert likely_error(calibrate(views(0.0, 0), SIZE), RANGE_M).within(1e-4, 0.95) == 1.0


def test_a_bend_of_one_lifts_the_middle_of_the_longer_edge_by_half_its_length():
    """Of a board of 0.4 m by 0.2 m: x^2 and y^2 in units of its larger half side, and x y."""
    board_m = np.array([[x, y, 0.0] for x in (1.0, 1.2, 1.4) for y in (2.0, 2.2)])
    bends_m = _bends_m(board_m)
    np.testing.assert_allclose(bends_m[:, 0], 0.2 * np.repeat([1.0, 0.0, 1.0], 2), atol=1e-12)
    np.testing.assert_allclose(bends_m[:, 1], 0.2 * 0.25, atol=1e-12)
    np.testing.assert_allclose(bends_m[:, 2], 0.2 * np.array([0.5, -0.5, 0.0, 0.0, -0.5, 0.5]), atol=1e-12)


def test_shares_and_probabilities_on_paper():
    """Four draws of five pixels, one pixel without a ray."""
    inf = np.inf
    draws = np.array([[1, 2, 3, 4, inf], [2, 3, 4, 5, inf], [1, 1, 1, 1, inf], [9, 9, 9, 9, inf]], float)
    told = LikelyError(1.0, (1, 5), draws, 0.0, 0.0)
    assert told.within(4.0, 0.8) == 0.5
    assert told.within(1.0, 0.2) == 0.5
    assert told.within(100.0, 0.9) == 0.0
    assert told.of_share_m(0.75, 0.5) == 5.0
    assert told.of_share_m(0.9, 0.5) == inf
    assert told.share_within(3.0, 1.0) == 0.0
    assert told.share_within(3.0, 0.0) == pytest.approx(0.8)
    np.testing.assert_array_equal(told.map_m(1.0), [[9, 9, 9, 9, np.nan]])


def test_an_impossible_range_is_refused():
    with pytest.raises(InputError, match="range of -1 m"):
        likely_error(calibrate(views(0.2, 0), SIZE), -1.0)
