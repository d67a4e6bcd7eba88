"""The estimated camera against the one that took the views, and its own word on how sure it is."""

import cv2
import numpy as np
import pytest

from packetmesh.errors import InputError, ReconstructionError
from pipeline.calibration.board import Board
from pipeline.calibration.detect import detect
from pipeline.calibration.estimate import FLAGS, View, calibrate, held_out, inverted, rms_px
from pipeline.calibration.warp import board_warp
from tests.pipeline.calibration.views import CAMERA, photograph, poses, seen, views

BOARD = Board()
SIZE = (CAMERA.width_px, CAMERA.height_px)
TRUTH = dict(
    zip(("fx", "fy", "cx", "cy", "k1", "k2"), (600.0, 604.0, 318.0, 243.0, -0.12, 0.05), strict=True)
)


def test_without_noise_the_camera_is_found_exactly():
    found = calibrate(views(BOARD), SIZE)
    for name, value in TRUTH.items():
        assert found.parameters[name] == pytest.approx(value, abs=1e-3)
    assert found.rms_px < 1e-4
    for view, T in zip(found.views, poses(BOARD), strict=True):
        np.testing.assert_allclose(view.T_camera_board, T, atol=1e-5)


def bent_board(given, size_px):
    return board_warp(given, size_px, BOARD, 2).calibration


@pytest.mark.parametrize("estimate", [calibrate, bent_board])
def test_the_same_views_give_the_same_bits_however_many_threads_there_are(estimate):
    given, threads = views(BOARD, noise_px=0.4, count=10), cv2.getNumThreads()
    found = set()
    try:
        for count in (1, 4, 4, 4, 4, 4):
            cv2.setNumThreads(count)
            camera = estimate(given, SIZE)
            found.add((camera.matrix.tobytes(), camera.distortion.tobytes()))
            assert cv2.getNumThreads() == count
    finally:
        cv2.setNumThreads(threads)
    assert len(found) == 1


@pytest.mark.parametrize("lens", ["thesis", "brown"])
def test_standard_errors_are_those_of_opencv(lens):
    given = views(BOARD, noise_px=0.4)
    found = calibrate(given, SIZE, lens)
    board_m = [view.board_m.astype(np.float32) for view in given]
    seen_px = [view.points_px.astype(np.float32) for view in given]
    theirs = cv2.calibrateCameraExtended(board_m, seen_px, SIZE, None, None, flags=FLAGS[lens])[5].ravel()
    np.testing.assert_allclose(list(found.standard_errors.values()), theirs[: len(found.names)], rtol=0.02)


def test_what_the_views_do_not_tell_is_unsure_and_never_sure():
    told = np.array([[4.0, 4.0], [4.0, 4.0]])  # the sum of two parameters, to within a half
    covariance = inverted(told)
    assert np.sqrt(np.diag(covariance)).min() > 1e5
    assert np.ones(2) @ covariance @ np.ones(2) == pytest.approx(0.25, rel=1e-3)
    known = np.diag([4.0, 1e-12, 1e12])
    np.testing.assert_allclose(inverted(known), np.diag([0.25, 1e12, 1e-12]))


def test_the_truth_lies_within_the_intervals_about_as_often_as_they_say():
    inside = []
    for seed in range(25):
        found = calibrate(views(BOARD, noise_px=0.3, seed=seed), SIZE)
        inside += [low <= TRUTH[name] <= high for name, (low, high) in found.intervals.items()]
    assert 0.88 < np.mean(inside) <= 1.0


def test_views_that_were_held_out_are_predicted_about_as_well_and_never_better_on_average():
    given = views(BOARD, noise_px=0.3)
    found, unseen = calibrate(given, SIZE), held_out(given, SIZE, 2)
    assert [view.name for view in unseen] == [view.name for view in given]
    all_px = rms_px(np.concatenate([view.residuals_px for view in unseen]))
    assert found.rms_px < all_px < 1.5 * found.rms_px


def test_the_whole_way_from_photographs():
    given = []
    for index, T in enumerate(poses(BOARD)):
        one = detect(photograph(BOARD, T), BOARD)
        given.append(View(str(index), one.points_px, BOARD.points_m[one.indices]))
    found = calibrate(given, SIZE)
    assert found.rms_px < 0.15
    assert found.parameters["fx"] == pytest.approx(600.0, rel=0.003)
    assert found.parameters["cx"] == pytest.approx(318.0, abs=2.0)


def test_boards_held_ever_alike_do_not_make_a_camera():
    rng = np.random.default_rng(0)
    same = []
    for index in range(5):
        T = poses(BOARD)[0].copy()
        T[:2, 3] += 0.02 * index
        same.append(View(str(index), seen(BOARD, T, noise_px=0.2, rng=rng), BOARD.points_m))
    with pytest.raises(ReconstructionError, match="nearly the same direction"):
        calibrate(same, SIZE)


def test_too_few_views_and_impossible_folds_are_told():
    given = views(BOARD)
    with pytest.raises(InputError, match="found in 2 images"):
        calibrate(given[:2], SIZE)
    with pytest.raises(InputError, match="no lens 'fish'"):
        calibrate(given, SIZE, "fish")
    for folds in (1, 9):
        with pytest.raises(InputError, match="try 2 to 8"):
            held_out(given, SIZE, folds)
