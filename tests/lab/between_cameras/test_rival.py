"""Tiles that a node predicts from another camera's depth."""

from dataclasses import replace

import numpy as np

from lab.between_cameras.rival import DepthView, Thresholds, predicted_tiles, warped
from pipeline.types import CameraIntrinsics

CAMERA = CameraIntrinsics.pinhole(260.0, 260.0, 159.5, 127.5, 320, 256)
THRESHOLDS = Thresholds(sigmas=3.0, share=0.9)


def wall(x_m: float = 0.0, board: bool = False) -> DepthView:
    """A wall at 2 m, before it a board at 1 m from x = -0.2 to 0.2, seen from (x, 0, 0)."""
    z_m = np.full((256, 320), 2.0)
    T = np.eye(4)
    T[0, 3] = x_m
    if board:
        on_board_m = x_m + (np.arange(320) - CAMERA.cx_px) / CAMERA.fx_px
        z_m[:, np.abs(on_board_m) <= 0.2] = 1.0
    return DepthView(z_m, z_m, CAMERA, T)


def test_from_one_place_all_is_predicted_and_the_first_camera_sends_all():
    first, second = predicted_tiles([wall(), wall()], THRESHOLDS)
    assert not first.any()
    assert second.all()


def test_what_the_first_camera_does_not_see_is_sent():
    _, second = predicted_tiles([wall(), wall(0.41)], THRESHOLDS)
    assert second[:, :8].all()
    assert not second[:, 8:].any()
    board = [wall(board=True), wall(0.6, board=True)]
    _, second = predicted_tiles(board, THRESHOLDS)
    x_m = 0.6 + 2.0 * (np.arange(320) - CAMERA.cx_px) / CAMERA.fx_px
    hidden = (np.abs(x_m) < 0.4) & (board[1].z_m[0] > 1.5)
    assert not second[:, hidden.reshape(10, 32).mean(axis=1) > 0.2].any()
    assert second.any()


def test_tiles_that_a_camera_leaves_out_predict_nothing():
    """The third camera sees what only the first one sends."""
    masks = predicted_tiles([wall(), wall(), wall(0.41)], THRESHOLDS)
    assert masks[1].all()
    np.testing.assert_array_equal(masks[2], predicted_tiles([wall(), wall(0.41)], THRESHOLDS)[1])


def test_depth_beyond_the_noise_or_nowhere_measured_is_not_predicted():
    view = wall()
    farther = replace(view, z_m=view.z_m + 0.05)
    assert not predicted_tiles([view, farther], THRESHOLDS)[1].any()
    nothing = replace(view, z_m=np.full_like(view.z_m, np.nan))
    assert not predicted_tiles([view, nothing], THRESHOLDS)[1].any()


def test_the_nearest_surface_is_seen_and_cracks_are_closed():
    seen_m, sd_m = warped(wall(board=True), wall(board=True).known_m, wall(0.3))
    on_board = np.abs(0.3 + (np.arange(320) - CAMERA.cx_px) / CAMERA.fx_px) < 0.19
    assert (seen_m[:, on_board] == 1.0).all()
    assert np.isfinite(sd_m[np.isfinite(seen_m)]).all()
