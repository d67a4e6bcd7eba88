"""Depth images of clouds whose points cover squares."""

import numpy as np

from pipeline.kernels.geometry import look_at
from pipeline.kernels.splat import splat_depth
from pipeline.types import CameraIntrinsics

CAMERA = CameraIntrinsics.pinhole(100.0, 100.0, 15.0, 10.0, 31, 21)


def seen(points_m, side_m=0.05, T=None):
    return splat_depth(
        np.array(points_m, float).reshape(-1, 3), side_m, CAMERA, np.eye(4) if T is None else T
    )


def test_a_point_covers_a_square_of_its_side_at_its_depth():
    """5 cm at 1 m are 5 pixels, at 2.5 m two: those within one pixel of its middle."""
    near = seen([0, 0, 1.0])
    assert np.isfinite(near).sum() == 25
    assert (near[8:13, 13:18] == 1.0).all()
    far = seen([0.0125, 0, 2.5])  # half a pixel to the right
    np.testing.assert_array_equal(np.argwhere(np.isfinite(far))[:, 1] - 15, [0, 1] * 3)


def test_the_nearest_point_hides_the_others_in_any_order():
    points = [[0, 0, 2.0], [0, 0, 1.0], [0, 0, 3.0]]
    np.testing.assert_array_equal(seen(points), seen(points[::-1]))
    assert seen(points)[10, 15] == 1.0


def test_squares_are_cut_at_the_rim_and_points_behind_the_camera_are_not_seen():
    assert np.isfinite(seen([-0.16, 0, 1.0])).sum() == 2 * 5  # its middle is one pixel outside
    assert not np.isfinite(seen([[0, 0, -1.0], [0, 0, 0.01], [9, 0, 1.0]])).any()
    assert not np.isfinite(seen([])).any()


def test_the_camera_may_stand_anywhere():
    T = look_at([1.0, 2.0, 3.0], [1.0, 5.0, 3.0])
    assert seen([1.0, 4.0, 3.0], T=T)[10, 15] == 2.0
