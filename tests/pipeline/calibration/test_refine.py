"""Perspective moves the middle of a circle's image; the refined centres are where the circles are."""

import cv2
import numpy as np
import pytest

from pipeline.calibration.board import Board
from pipeline.calibration.detect import detect
from pipeline.calibration.estimate import FittedView, View, calibrate, held_out, place, rms_px
from pipeline.calibration.lens import Optics
from pipeline.calibration.refine import _samples, refined_px
from pipeline.kernels.geometry import rigid, rotation_exp
from tests.pipeline.calibration.views import CAMERA, photograph, seen

OPTICS = Optics("thesis", CAMERA.matrix, CAMERA.distortion)
BOARDS = [Board(), Board("circles-asymmetric", 4, 11, 0.02), Board("circles", 6, 6, 0.03)]


def tilted(board, tilt_deg, axis_deg):
    """(4, 4) of a board in the middle of the picture."""
    axis = np.radians(axis_deg)
    size_m = np.ptp(board.points_m[:, :2], axis=0) + 3.0 * board.spacing_m
    away_m = 1.35 * max(size_m[0], CAMERA.width_px / CAMERA.height_px * size_m[1])
    turn = np.radians(tilt_deg) * np.array([np.cos(axis), np.sin(axis), 0.0])
    return rigid(rotation_exp(turn), np.array([0.0, 0.0, away_m]))


def found_in(board, T, seed):
    """A noisy photograph, the view in it, and where its points are."""
    noise = np.random.default_rng(seed).normal(0.0, 3.0, (CAMERA.height_px, CAMERA.width_px))
    gray = np.clip(np.rint(photograph(board, T) + noise), 0, 255).astype(np.uint8)
    return gray, View(str(seed), detect(gray, board).points_px, board.points_m), seen(board, T)


def off_px(points_px, true_px):
    return np.linalg.norm(points_px - true_px, axis=1).mean()


@pytest.mark.parametrize("board", BOARDS, ids=["thesis", "shifted", "square"])
@pytest.mark.parametrize("tilt_deg", [0, 15, 30, 40, 50])
def test_centres_come_nearer_at_every_tilt_and_do_not_depend_on_it(board, tilt_deg):
    gray, view, true_px = found_in(board, tilted(board, tilt_deg, 40.0 + 7.0 * tilt_deg), tilt_deg)
    fitted = place(view, CAMERA.matrix, CAMERA.distortion)
    after_px = off_px(refined_px(gray, board, fitted, OPTICS), true_px)
    assert after_px < 0.8 * off_px(view.points_px, true_px)
    assert after_px < 0.02


@pytest.mark.parametrize(("distance_m", "samples"), [(1.0, 60), (0.75, 80), (0.4, 121), (3.0, 41)])
def test_a_neighbourhood_has_a_sample_a_pixel_within_limits(distance_m, samples):
    """Of a circle whose nearest is 0.1 m away, seen flat by a lens of 600 px."""
    board = Board("circles", 5, 4, 0.1)
    optics = Optics(
        "thesis", np.array([[600.0, 0.0, 319.5], [0.0, 600.0, 239.5], [0.0, 0.0, 1.0]]), np.zeros(5)
    )
    T = rigid(np.eye(3), np.array([0.0, 0.0, distance_m]))
    points_px = optics.project(board.points_m, T)
    view = FittedView("", T, np.zeros_like(points_px), points_px, board.points_m)
    assert _samples(view, board) == pytest.approx(samples, abs=1)


def test_the_camera_and_what_it_predicts_become_better():
    board, given, refined, pictures = BOARDS[0], [], [], []
    for index, tilt_deg in enumerate((0, 20, 25, 30, 35, 40, 45, 50)):
        gray, view, _ = found_in(board, tilted(board, tilt_deg, 75.0 * index), index)
        given.append(view)
        pictures.append(gray)
    size_px = (CAMERA.width_px, CAMERA.height_px)
    before = calibrate(given, size_px)
    for gray, view, fitted in zip(pictures, given, before.views, strict=True):
        refined.append(View(view.name, refined_px(gray, board, fitted, before.optics), board.points_m))
    after = calibrate(refined, size_px)
    assert abs(after.parameters["fx"] - 600.0) < 0.5 * abs(before.parameters["fx"] - 600.0)
    unseen = [held_out(views, size_px, 2) for views in (given, refined)]
    worse, better = (rms_px(np.concatenate([view.residuals_px for view in views])) for views in unseen)
    assert better < 0.7 * worse


def test_light_circles_on_dark_paper_are_centred_too():
    board = BOARDS[2]
    gray, view, true_px = found_in(board, tilted(board, 35.0, 10.0), 1)
    fitted = place(view, CAMERA.matrix, CAMERA.distortion)
    assert off_px(refined_px(255 - gray, board, fitted, OPTICS), true_px) < 0.02


def test_a_circle_that_cannot_be_seen_stays_where_it_was():
    board = BOARDS[2]
    gray, view, _ = found_in(board, tilted(board, 20.0, 10.0), 2)
    fitted = place(view, CAMERA.matrix, CAMERA.distortion)
    blank = np.full_like(gray, 180)
    np.testing.assert_array_equal(refined_px(blank, board, fitted, OPTICS), view.points_px)
    glare = gray.copy()
    x, y = view.points_px[7].round().astype(int).tolist()
    cv2.rectangle(glare, (x, y - 30), (x + 30, y + 30), 255, -1)
    np.testing.assert_array_equal(refined_px(glare, board, fitted, OPTICS)[7], view.points_px[7])
