"""From a click's ray to a disc in the image, and which points and pixels discs cover."""

import numpy as np
import pytest

from app.screens.depth.brush import REACH_DEG, clicked_disc, painted, picked_point
from app.screens.depth.discs import covered, disc_at, disc_px, window_around
from app.screens.depth.view import Disc, SeenSample

WIDTH_PX, HEIGHT_PX, FOCAL_PX = 160, 120, 150.0
FORWARD = np.array([0.0, 0.0, 1.0])


def wall(z_m=2.0):
    """Every pixel of a pinhole camera that looks straight at a wall."""
    u, v = (grid.ravel() for grid in np.meshgrid(np.arange(WIDTH_PX), np.arange(HEIGHT_PX)))
    ray = np.stack([(u - 79.5) / FOCAL_PX, (v - 59.5) / FOCAL_PX, np.ones(u.size)], axis=1)
    return SeenSample(
        (z_m * ray).astype(np.float32), None, u.size, np.stack([u, v], axis=1), WIDTH_PX, HEIGHT_PX
    )


def turned():
    """A camera that stands and looks somewhere."""
    angle = 0.7
    rotation = np.array([[np.cos(angle), 0, np.sin(angle)], [0, 1, 0], [-np.sin(angle), 0, np.cos(angle)]])
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = rotation, (0.3, -1.2, 0.8)
    return T


@pytest.mark.parametrize(("u", "v"), [(0, 0), (159, 119), (80, 60), (31, 102)])
@pytest.mark.parametrize("T_world_camera", [np.eye(4), turned()])
@pytest.mark.parametrize("eye_m", [(0.0, 0.0, 0.0), (0.4, 0.3, -1.5)])
def test_a_ray_through_a_point_gives_the_disc_around_its_pixel(u, v, T_world_camera, eye_m):
    cloud = wall()
    (index,) = np.flatnonzero(np.all(cloud.pixels == (u, v), axis=1))
    T = T_world_camera
    eye_m, point_m = (T[:3, :3] @ np.asarray(at) + T[:3, 3] for at in (eye_m, cloud.points_m[index]))
    disc = clicked_disc(cloud, T, eye_m, 3.0 * (point_m - eye_m), 0.2)
    assert disc == Disc(u / 159, v / 119, 0.2)


def test_the_surface_in_front_is_meant_and_there_the_point_closest_to_the_ray():
    aside_m = 2.0 * np.tan(np.radians(0.5 * REACH_DEG))
    points_m = np.array([[0.0, 0.0, 4.0], [aside_m, 0.0, 2.0], [0.3 * aside_m, 0.0, 2.05], [0.0, 0.0, -1.0]])
    assert picked_point(points_m, np.zeros(3), FORWARD) == 2
    assert picked_point(points_m, np.zeros(3), -FORWARD) == 3
    assert picked_point(points_m[:1], np.zeros(3), 0.1 * FORWARD) == 0


@pytest.mark.parametrize(("angle_deg", "picked"), [(0.9 * REACH_DEG, 0), (1.1 * REACH_DEG, None)])
def test_a_click_reaches_points_up_to_a_degree_away(angle_deg, picked):
    at_m = np.array([[0.0, 3.0 * np.tan(np.radians(angle_deg)), 3.0]])
    assert picked_point(at_m, np.zeros(3), FORWARD) == picked


def test_a_ray_beside_behind_or_without_a_cloud_means_nothing():
    cloud = wall()
    assert clicked_disc(cloud, np.eye(4), np.zeros(3), np.array([1.0, 0.0, 0.0]), 0.2) is None
    assert clicked_disc(cloud, np.eye(4), np.zeros(3), -FORWARD, 0.2) is None
    assert picked_point(np.empty((0, 3)), np.zeros(3), FORWARD) is None


def test_a_disc_is_where_it_was_put_and_as_large_as_asked():
    assert disc_px(disc_at(31, 102, WIDTH_PX, HEIGHT_PX, 0.25), WIDTH_PX, HEIGHT_PX) == pytest.approx(
        (31.0, 102.0, 20.0)
    )
    assert disc_at(0, 0, 1, 1, 0.2) == Disc(0.0, 0.0, 0.2)


def test_the_points_that_are_drawn_as_painted_are_those_whose_pixels_are_hidden():
    discs = (Disc(0.2, 0.3, 0.2), Disc(0.3, 0.35, 0.1), Disc(1.0, 1.0, 0.3))
    cloud = wall()
    v, u = np.mgrid[:HEIGHT_PX, :WIDTH_PX]
    pixels = covered(discs, u, v, WIDTH_PX, HEIGHT_PX)
    np.testing.assert_array_equal(painted(cloud, discs), pixels.ravel())
    areas = [covered((disc,), u, v, WIDTH_PX, HEIGHT_PX).sum() for disc in discs]
    assert max(areas) < pixels.sum() < sum(areas)
    assert areas[0] == pytest.approx(np.pi * 16.0**2, rel=0.02)
    assert not painted(cloud, ()).any()


def test_the_window_holds_all_discs_and_stays_in_the_image():
    rows, columns = window_around((Disc(0.3, 0.5, 0.1), Disc(0.7, 0.5, 0.1)), WIDTH_PX, HEIGHT_PX)
    assert (columns.start, columns.stop) == (int(0.3 * 159 - 20), int(0.7 * 159 + 20) + 1)
    assert (rows.start, rows.stop) == (int(59.5 - 20), int(59.5 + 20) + 1)
    rows, columns = window_around((Disc(0.0, 1.0, 0.6),), WIDTH_PX, HEIGHT_PX)
    assert (columns.start, columns.stop) == (0, 121)
    assert rows.stop == HEIGHT_PX
