"""How sure a camera is at a range: against many simulated calibrations, and lenses of a wrong kind."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import chi2

from packetmesh.errors import InputError, ReconstructionError
from pipeline.calibration.board import Board
from pipeline.calibration.estimate import View, calibrate, settle
from pipeline.calibration.lens import Optics
from pipeline.calibration.trust import half_difference_px, projected_sd_px, sd_map, sight
from pipeline.kernels.geometry import apply, rigid, rotation_exp
from tests.pipeline.calibration.views import CAMERA

BOARD = Board("circles", 7, 5, 0.05)
SIZE = (CAMERA.width_px, CAMERA.height_px)


def board_poses(count, seed=0):
    """(4, 4) of boards in all parts of the picture, tilted to all sides, near and far."""
    rng, made = np.random.default_rng(seed), []
    while len(made) < count:
        axis = rng.uniform(0.0, 2.0 * np.pi)
        tilt = np.radians(rng.uniform(15.0, 45.0)) * np.array([np.cos(axis), np.sin(axis), 0.0])
        away_m = rng.uniform(0.4, 0.8)
        T = rigid(rotation_exp(tilt), np.array([*rng.uniform(-0.3, 0.3, 2) * away_m, away_m]))
        points_px = Optics("brown", CAMERA.matrix, CAMERA.distortion).project(BOARD.points_m, T)
        if ((points_px >= 5.0) & (points_px <= np.array(SIZE) - 6.0)).all():
            made.append(T)
    return made


def views(noise_px, seed, count=10, distortion=None, lens="brown"):
    """The same boards with another noise for each seed."""
    optics = Optics(lens, CAMERA.matrix, CAMERA.distortion if distortion is None else np.array(distortion))
    rng = np.random.default_rng((1, seed))
    return [
        View(
            str(index), optics.project(BOARD.points_m, T) + rng.normal(0.0, noise_px, (35, 2)), BOARD.points_m
        )
        for index, T in enumerate(board_poses(count))
    ]


@pytest.fixture(scope="module")
def many():
    """Calibrations of the same boards with other noise each."""
    return [calibrate(views(0.2, seed), SIZE) for seed in range(240)]


@pytest.mark.parametrize("range_m", [0.6, 3.0])
def test_the_map_is_the_spread_of_many_calibrations(many, range_m):
    truth = calibrate(views(0.0, 0), SIZE)
    seen = sight(truth.optics, SIZE, range_m)
    boards_m = np.concatenate([apply(view.T_camera_board, view.board_m) for view in truth.views])
    boards_px = truth.optics.project(boards_m)
    told = [
        one.optics.project(seen.points_m, settle(boards_m, boards_px, np.eye(4), one.optics)) for one in many
    ]
    off_px = np.array(told) - truth.optics.project(seen.points_m)
    spread = np.einsum("kgi,kgj->gij", off_px, off_px) / len(off_px)
    predicted_px = np.mean([projected_sd_px(one, range_m).error_px for one in many[:30]], axis=0)
    ratio = predicted_px / np.sqrt(np.linalg.eigvalsh(spread)[:, 1]).reshape(predicted_px.shape)
    assert 0.85 < np.median(ratio) < 1.15
    assert ratio.min() > 0.8
    assert ratio.max() < 1.2


def test_millimetres_are_pixels_at_the_range():
    found = calibrate(views(0.2, 0), SIZE)
    near, far = (projected_sd_px(found, range_m) for range_m in (2.0, 4.0))
    row, column = (len(axis) // 2 for axis in (near.rows_px, near.columns_px))
    for told in (near, far):
        error_px, error_m = told.error_px[row, column], told.error_m[row, column]
        assert error_m == pytest.approx(told.range_m * error_px / 600.0, rel=0.05)


def test_cells_cover_the_image_evenly_from_edge_to_edge():
    """From half a pixel before the first pixel's middle to half a pixel behind the last one's."""
    seen = sight(calibrate(views(0.0, 0), SIZE).optics, SIZE, 2.0)
    for middles_px, size_px in ((seen.columns_px, SIZE[0]), (seen.rows_px, SIZE[1])):
        half_px = 0.5 * size_px / len(middles_px)
        np.testing.assert_allclose(np.diff(middles_px), 2.0 * half_px)
        assert (middles_px[0], middles_px[-1]) == pytest.approx((half_px - 0.5, size_px - 0.5 - half_px))


def test_the_worst_direction_is_the_longer_axis_of_the_ellipse():
    """Variances 6 and 1 px^2 along (2, 1) and (-1, 2)."""
    seen = sight(calibrate(views(0.0, 0), SIZE).optics, SIZE, 2.0)
    count = len(seen.points_m)
    flat = replace(seen, metres=np.tile(0.01 * np.eye(2), (count, 1, 1)))
    told = sd_map(flat, np.tile([[5.0, 2.0], [2.0, 2.0]], (count, 1, 1)))
    np.testing.assert_allclose(told.error_px, np.sqrt(6.0))
    np.testing.assert_allclose(told.error_m, 0.01 * np.sqrt(6.0))


def test_more_views_make_surer():
    few, many = (projected_sd_px(calibrate(views(0.2, 0, count), SIZE), 2.0).error_px for count in (6, 24))
    assert np.median(many) < 0.7 * np.median(few)


def test_halves_agree_within_noise_when_the_lens_is_right():
    told = [half_difference_px(views(0.2, seed), SIZE, 2.0) for seed in range(20)]
    assert sum(one.beyond_noise for one in told) <= 3
    assert 0.5 < np.mean([one.ratio**2 for one in told]) < 1.2
    # As for the root of the mean square of six normal numbers alike, of one alone, or between.
    alike, alone = np.sqrt(chi2.ppf(0.95, [6, 1]) / [6, 1])
    assert all(0.95 * alike < one.most_by_noise < 1.05 * alone for one in told)


@pytest.mark.parametrize(
    "distortion",
    [[-0.3, 0.15, 0.0, 0.0, -1.2], [-0.3, 0.15, 0.005, -0.003, 0.0]],
    ids=["k3", "tangential"],
)
def test_halves_differ_by_more_than_noise_when_the_lens_is_wrong(distortion):
    given = [views(0.05, seed, 16, distortion) for seed in range(4)]
    wrong = [half_difference_px(one, SIZE, 2.0, "thesis") for one in given]
    right = [half_difference_px(one, SIZE, 2.0, "brown") for one in given]
    assert all(one.beyond_noise for one in wrong)
    assert not any(one.beyond_noise for one in right)
    assert all(bad.ratio > 1.8 * good.ratio for bad, good in zip(wrong, right, strict=True))


def test_impossible_ranges_and_too_few_views_are_told():
    found = calibrate(views(0.2, 0), SIZE)
    for range_m in (0.0, -1.0, np.nan, np.inf):
        with pytest.raises(InputError, match="cannot be judged"):
            projected_sd_px(found, range_m)
    with pytest.raises(InputError, match="5 views cannot be halved"):
        half_difference_px(views(0.2, 0, 5), SIZE, 2.0)


def test_halves_that_determine_no_lens_say_nothing():
    with pytest.raises(ReconstructionError, match="Half of the views do not determine this lens"):
        half_difference_px(views(0.2, 1, 7), SIZE, 2.0, "rational")
