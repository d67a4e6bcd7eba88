"""Viewpoints: everything is in the picture, from the side that was seen, and upright."""

import numpy as np
import pytest

from pipeline.acquisition import back_project
from pipeline.io.demos import load_demo
from pipeline.kernels.geometry import apply, inverse, project
from pipeline.notebook.views import in_its_camera, view_of
from pipeline.types import PointCloud

BALL = np.random.default_rng(0).normal(size=(2000, 3))
BALL_M = np.array([3.0, -2.0, 1.0]) + 0.7 * BALL / np.linalg.norm(BALL, axis=1, keepdims=True)


def seen(view, points_m):
    """Pixels of the points in a picture of 280 x 210, and their depth."""
    camera = view.camera(280, 210)
    own_m = apply(inverse(camera.T_world_camera), points_m)
    return project(camera.intrinsics, own_m), own_m[:, 2]


@pytest.mark.parametrize("in_camera", [False, True])
def test_all_points_are_in_the_picture_and_fill_it(in_camera):
    pixels, z_m = seen(view_of(BALL_M, in_camera=in_camera), BALL_M)
    assert (z_m > 0.0).all()
    inside = (pixels >= 0.0).all(axis=1) & (pixels <= (279.0, 209.0)).all(axis=1)
    assert inside.mean() > 0.97
    assert np.ptp(pixels[:, 1]) > 0.8 * 210
    np.testing.assert_allclose(pixels.mean(axis=0), (139.5, 104.5), atol=8.0)


@pytest.mark.parametrize(("in_camera", "up"), [(False, (0.0, 0.0, 1.0)), (True, (0.0, -1.0, 0.0))])
def test_up_is_up(in_camera, up):
    view = view_of(BALL_M, in_camera=in_camera)
    pixels, _ = seen(view, np.array([view.look_at_m, view.look_at_m + 0.1 * np.array(up)]))
    assert pixels[1, 1] < pixels[0, 1] - 3.0
    assert pixels[1, 0] == pytest.approx(pixels[0, 0], abs=1e-6)


@pytest.mark.parametrize("side", [(1.0, 0.0, 0.0), (0.0, -1.0, 0.0)])
def test_a_wall_is_seen_from_the_side_of_its_normals(side):
    wall_m = np.random.default_rng(1).uniform(-1.0, 1.0, (500, 3)) * (1.0 - np.abs(side))
    view = view_of(wall_m, np.tile(side, (500, 1)))
    assert (view.position_m - view.look_at_m) @ side > 1.0
    assert view.position_m[2] > view.look_at_m[2]


def test_a_cloud_in_its_cameras_frame_is_told_by_its_pixels():
    frame = load_demo("living-room").frames[0]
    cloud = back_project(frame)
    assert in_its_camera(cloud)
    assert not in_its_camera(cloud.transformed(frame.T_world_camera))
    assert not in_its_camera(PointCloud(cloud.points_m))
    assert not in_its_camera(cloud.select(np.arange(3)))


def test_a_single_point_has_a_view():
    view = view_of(np.array([[1.0, 2.0, 3.0]]))
    assert np.isfinite(view.position_m).all()
    assert not np.allclose(view.position_m, view.look_at_m)
