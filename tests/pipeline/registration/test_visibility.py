"""What a camera that measured a wall at 2 m with one hole says about points around it."""

import numpy as np

from pipeline.kernels.geometry import rigid
from pipeline.registration import hidden_from
from pipeline.types import CameraIntrinsics, DepthMap, PointCloud

CAMERA = CameraIntrinsics.pinhole(100, 100, 49.5, 49.5, 100, 100)


def wall() -> DepthMap:
    z_m = np.full((100, 100), 2.0, np.float32)
    z_m[40:60, 60:80] = np.nan
    return DepthMap(z_m)


def test_only_points_that_the_sensor_cannot_judge_are_hidden():
    points_m = np.array(
        [
            [0.0, 0.0, 1.0],  # floats before the wall
            [0.0, 0.0, 2.05],  # on the wall, but for the error of a guess
            [0.0, 0.0, 3.0],  # behind the wall
            [0.4, 0.0, 2.0],  # in the hole (u = 69.5)
            [5.0, 0.0, 2.0],  # outside the image
            [0.0, 0.0, -1.0],  # behind the camera
        ]
    )
    hidden = hidden_from(PointCloud(points_m), np.eye(4), CAMERA, wall())
    np.testing.assert_array_equal(hidden, [False, False, True, True, True, True])


def test_moving_points_and_camera_together_changes_nothing():
    rng = np.random.default_rng(1)
    points_m = rng.uniform((-2, -2, -1), (2, 2, 4), (500, 3))
    T = rigid(np.eye(3), [3.0, -1.0, 7.0])
    here = hidden_from(PointCloud(points_m), np.eye(4), CAMERA, wall())
    there = hidden_from(PointCloud(points_m + T[:3, 3]), np.linalg.inv(T), CAMERA, wall())
    np.testing.assert_array_equal(here, there)
    assert 0 < here.sum() < 500
