"""What two cameras both measured: known answers before a wall at 2 m with a hole."""

import numpy as np
import pytest

from pipeline.kernels.geometry import pixel_rays, rigid
from pipeline.placement.agreement import NOTHING_SHARED, Agreement, agreement
from pipeline.types import CameraIntrinsics, DepthMap, PointCloud

CAMERA = CameraIntrinsics.pinhole(100, 100, 49.5, 49.5, 100, 100)
POINTS = 2000


def wall(z_m: float = 2.0) -> DepthMap:
    depth = np.full((100, 100), z_m, np.float32)
    depth[40:60, 60:80] = np.nan
    return DepthMap(depth)


def seen(depth: DepthMap) -> PointCloud:
    """Every fifth point that the camera measured."""
    points_m = (pixel_rays(CAMERA) * depth.z_m[..., None]).astype(float)[depth.valid][::5]
    return PointCloud(points_m)


def test_a_cloud_agrees_wholly_with_the_image_that_it_is_of():
    found = agreement(seen(wall()), np.eye(4), CAMERA, wall())
    assert found.within_2pct_share == found.overlap_share == 1.0


@pytest.mark.parametrize(("nearer_m", "within"), [(0.03, 1.0), (-0.03, 1.0), (0.05, 0.0), (-0.05, 0.0)])
def test_two_percent_of_two_metres_are_four_centimetres_before_and_behind(nearer_m, within):
    found = agreement(seen(wall(2.0 - nearer_m)), np.eye(4), CAMERA, wall())
    assert found.overlap_share == 1.0
    assert found.within_2pct_share == within


def test_what_is_hidden_behind_the_wall_says_nothing_and_what_floats_before_it_speaks_against():
    behind = agreement(seen(wall(4.0)), np.eye(4), CAMERA, wall())
    before = agreement(seen(wall(1.0)), np.eye(4), CAMERA, wall())
    assert behind.shared == 0
    assert np.isnan(behind.within_2pct_share)
    assert before.overlap_share > 0.9
    assert before.within_2pct_share == 0.0


def test_points_in_the_hole_beside_the_image_and_behind_the_camera_are_not_shared():
    points_m = np.array([[0.4, 0.0, 2.0], [5.0, 0.0, 2.0], [0.0, 0.0, -2.0], [0.0, 0.0, 2.0]])
    assert agreement(PointCloud(points_m), np.eye(4), CAMERA, wall()) == Agreement(4, 1, 1)


def test_moving_the_cloud_and_its_pose_together_changes_nothing():
    T = rigid(np.eye(3), [3.0, -1.0, 7.0])
    cloud = seen(wall(1.99))
    moved = PointCloud(cloud.points_m + T[:3, 3])
    assert agreement(moved, np.linalg.inv(T), CAMERA, wall()) == agreement(cloud, np.eye(4), CAMERA, wall())


def test_counts_add_up_and_no_point_shares_nothing():
    assert Agreement(10, 8, 6) + Agreement(10, 2, 1) == Agreement(20, 10, 7)
    empty = PointCloud(np.empty((0, 3)))
    assert agreement(empty, np.eye(4), CAMERA, wall()) == NOTHING_SHARED
    assert NOTHING_SHARED.overlap_share == 0.0
