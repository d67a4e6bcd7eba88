"""Cameras are registered by one depth a block."""

import numpy as np
import pytest

from pipeline.delivery import coarse
from pipeline.delivery.base_points import BaseView
from pipeline.delivery.base_poses import place_by_base
from pipeline.delivery.left_out import base_view
from pipeline.delivery.sink import images_of, units_per_m
from pipeline.io.demos import load_demo
from pipeline.kernels.geometry import inverse, rotation_angle_rad
from pipeline.types import ByteArray, FloatArray


@pytest.fixture(scope="module")
def office() -> tuple[list[BaseView], list[ByteArray], tuple[FloatArray, ...]]:
    """Base layers and coarse colours at poses 6 cm and 3 degrees off, and the true poses."""
    rig = load_demo("office")
    views, colors = [], []
    for frame in rig.frames:
        images = images_of(frame)
        views.append(base_view(images, units_per_m(frame.depth), frame.intrinsics, frame.T_world_camera))
        colors.append(coarse.read_color(coarse.write_color(images.rgb), frame.depth.z_m.shape))
    return views, colors, rig.truth.T_world_camera


def test_base_layers_find_the_cameras_of_an_office(office):
    views, colors, true = office
    placement = place_by_base(views, colors)
    assert len(placement.placed(views)) == 3
    for T, given, right in zip(placement.T_world_camera[1:], views[1:], true[1:], strict=True):
        found, expected = inverse(placement.T_world_camera[0]) @ T, inverse(true[0]) @ right
        off_m = np.linalg.norm((found - expected)[:3, 3])
        assert off_m < 0.02 < np.linalg.norm((given.T_world_camera - right)[:3, 3])
        assert rotation_angle_rad(found[:3, :3].T @ expected[:3, :3]) < np.radians(0.7)


def test_a_single_camera_keeps_its_pose(office):
    views, colors, _ = office
    (T,) = place_by_base(views[:1], colors[:1]).T_world_camera
    np.testing.assert_array_equal(T, views[0].T_world_camera)
