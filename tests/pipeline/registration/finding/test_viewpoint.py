"""Clouds that were seen from their origin are recognised, and others are not."""

import numpy as np
import pytest

from lab.worlds import box_room
from pipeline.registration.finding.surface import Surface
from pipeline.registration.finding.viewpoint import range_image
from pipeline.types import PointCloud
from tests.pipeline.registration.finding.places import room, scan
from tests.pipeline.registration.rooms import seen_by


@pytest.fixture(scope="module")
def camera_view():
    return seen_by(box_room(3, nodes=1), 0.002)[0].points_m


def shell(radius_m: float, count: int = 4000) -> np.ndarray:
    rays = np.random.default_rng(0).normal(size=(count, 3))
    return radius_m * rays / np.linalg.norm(rays, axis=1, keepdims=True)


def test_a_depth_image_is_seen_from_its_camera(camera_view):
    assert range_image(camera_view) is not None


@pytest.mark.parametrize("eye_m", [(1.0, 1.2, 1.3), (2.0, 1.5, 1.1)])
def test_a_spherical_scan_is_seen_from_its_scanner(eye_m):
    assert range_image(scan(eye_m, 0).points_m) is not None


@pytest.mark.parametrize("from_m", [(-5.0, 1.0, 1.0), (2.0, 1.5, 9.0)])
def test_a_whole_room_is_not_seen_from_outside(from_m):
    """Its near walls hide the others."""
    assert range_image(room(1) - from_m) is None


def test_two_views_in_one_frame_are_not_one_view(camera_view):
    assert range_image(np.concatenate([camera_view, camera_view * 0.6])) is None


def test_a_cloud_known_to_be_a_cameras_keeps_its_free_space_even_if_its_points_do_not_tell(camera_view):
    """The clutter of a close view fills one cell in front and behind."""
    both = np.concatenate([camera_view, camera_view * 0.6])
    view = range_image(both, from_camera=True)
    way = camera_view[:100]
    in_view, through = view.compare(np.concatenate([0.5 * way, 0.8 * way, way]), np.zeros(300))
    assert in_view.mean() > 0.95
    np.testing.assert_allclose([part.mean() for part in np.split(through, 3)], [1.0, 0.0, 0.0], atol=0.05)
    assert Surface(PointCloud(both), from_camera=True).view is not None
    assert Surface(PointCloud(both)).view is None


def test_the_viewpoint_knows_no_unit(camera_view):
    assert range_image(1000.0 * camera_view) is not None
    assert range_image(1000.0 * (room(1) + 5.0)) is None


@pytest.mark.parametrize(("radius_m", "in_view", "in_front"), [(1.5, 1, 1), (2.0, 1, 0), (2.6, 0, 0)])
def test_points_are_in_front_of_a_sphere_on_it_or_behind(radius_m, in_view, in_front):
    view = range_image(shell(2.0))
    assert view is not None
    seen, free = view.compare(shell(radius_m, 500), np.full(500, 0.01))
    assert (seen.all(), seen.any()) == (bool(in_view),) * 2
    assert (free.all(), free.any()) == (bool(in_front),) * 2


def test_where_nothing_was_measured_nothing_is_judged():
    """Half a sphere judges no point of the other half, however near."""
    half = shell(2.0, 8000)
    view = range_image(half[half[:, 2] > 0.0])
    assert view is not None
    below = shell(0.5, 2000)
    below = below[below[:, 2] < -0.1]
    seen, free = view.compare(below, np.zeros(len(below)))
    assert not seen.any()
    assert not free.any()
