"""A bent board is found out, and a flat one is left flat."""

import numpy as np
import pytest

from packetmesh.errors import InputError
from pipeline.calibration.board import Board
from pipeline.calibration.estimate import View, calibrate
from pipeline.calibration.lens import Optics
from pipeline.calibration.warp import board_warp
from tests.pipeline.calibration.test_trust import SIZE, board_poses
from tests.pipeline.calibration.views import CAMERA

BOARD = Board("circles", 7, 5, 0.05)
BEND_M = 0.003


def views_of(bent_m, count=14):
    optics, rng = Optics("thesis", CAMERA.matrix, CAMERA.distortion), np.random.default_rng(0)
    return [
        View(str(row), optics.project(bent_m, T) + rng.normal(0.0, 0.1, (35, 2)), BOARD.points_m)
        for row, T in enumerate(board_poses(count))
    ]


def bent_m():
    """A board whose left and right rims stand 3 mm above its middle."""
    points_m = BOARD.points_m
    points_m[:, 2] = BEND_M * (points_m[:, 0] / points_m[:, 0].max()) ** 2
    return points_m


def test_a_bend_of_3_mm_is_found_and_the_camera_comes_right():
    given = views_of(bent_m())
    told = board_warp(given, SIZE, BOARD, 2)
    assert told.warp_m == pytest.approx(BEND_M, abs=0.0004)
    assert told.helps
    assert told.rms_px < 0.5 * told.flat_rms_px
    wrong = abs(calibrate(given, SIZE).parameters["fx"] - 600.0)
    assert abs(told.calibration.parameters["fx"] - 600.0) < 0.2 * wrong
    assert wrong > 3.0


def test_a_flat_board_is_left_flat():
    told = board_warp(views_of(BOARD.points_m), SIZE, BOARD, 2)
    assert told.warp_m < 0.0005
    assert not told.helps


def test_what_cannot_be_bent_is_told():
    given = views_of(BOARD.points_m, 6)
    with pytest.raises(InputError, match="take more, or assume that the board is flat"):
        board_warp(given[:3], SIZE, BOARD, 2)
    with pytest.raises(InputError, match="fisheye"):
        board_warp(given, SIZE, BOARD, 2, "fisheye")
    part = [View("part", given[0].points_px[:20], given[0].board_m[:20]), *given[1:]]
    with pytest.raises(InputError, match="whole board"):
        board_warp(part, SIZE, BOARD, 2)
