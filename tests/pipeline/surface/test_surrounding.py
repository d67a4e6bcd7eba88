"""Radii that neither outliers nor uneven sampling defeat."""

import numpy as np
import pytest

from pipeline.surface.normals import oriented_normals
from pipeline.surface.radii import spacing
from pipeline.surface.surrounding import surrounding_distances_m, surrounding_radii
from pipeline.types import PointCloud
from tests.pipeline.surface.shapes import lidar_room, perforated_plane, sphere, torus_knot, with_outliers


def radii_of(cloud: PointCloud) -> np.ndarray:
    cloud = cloud if cloud.normals is not None else oriented_normals(cloud)
    return np.array(surrounding_radii(cloud.points_m, cloud.normals))


def test_within_a_grid_four_neighbours_surround_a_point_and_at_its_rim_none_do():
    plane = perforated_plane(0.4, 0.02, 0.0)
    distances_m = surrounding_distances_m(plane.points_m, plane.normals)
    rim = np.isinf(distances_m).sum()
    assert rim == 4 * 20
    assert np.all(np.abs(distances_m[np.isfinite(distances_m)] / 0.02 - 1.0) < 0.2)


def test_radii_grow_with_the_cloud_and_ascend():
    small, large = (radii_of(sphere(3000, radius_m)) for radius_m in (0.01, 100.0))
    np.testing.assert_allclose(large, 1e4 * small)
    assert (np.diff(small) > 0).all()


@pytest.mark.parametrize("cloud", [sphere(4000), torus_knot(8000, 0.4)], ids=["sphere", "knot"])
def test_one_outlier_in_twenty_hardly_changes_radii_and_multiplies_the_deviation_of_the_spacing(cloud):
    spoilt = with_outliers(cloud, 0.05)
    np.testing.assert_allclose(radii_of(spoilt), radii_of(PointCloud(cloud.points_m)), rtol=0.25)
    assert spacing(spoilt.points_m)[1] > 3.0 * spacing(cloud.points_m)[1]


@pytest.mark.parametrize("rings", [16, 32])
def test_balls_reach_from_one_ring_of_a_lidar_to_the_next(rings):
    room = lidar_room(rings, 0.005)
    gap_m = 3.0 * np.radians(40.0 / (rings - 1))  # of the nearest wall
    chosen_m = radii_of(room)
    assert chosen_m[-1] > gap_m > 3.0 * sum(spacing(room.points_m))


def test_points_of_a_curve_or_a_swarm_have_none():
    t = np.linspace(0.0, 1.0, 300)
    curve = PointCloud(np.column_stack([np.cos(t), np.sin(t), 0 * t]), normals=np.tile([0.0, 0, 1], (300, 1)))
    assert surrounding_radii(curve.points_m, curve.normals) == ()
