"""Normals without a camera: neighbours agree, and closed shapes are seen from outside."""

import numpy as np
import pytest

from packetmesh.errors import InputError
from pipeline.kernels.geometry import rigid, rotation_exp
from pipeline.surface.normals import oriented_normals, turned_to_viewpoint
from pipeline.types import PointCloud
from tests.pipeline.surface.shapes import lidar_room, perforated_plane, sphere, torus_knot


def agreement(cloud: PointCloud) -> np.ndarray:
    """(N,) cosines between the normals found from the points alone and the true ones."""
    found = oriented_normals(PointCloud(cloud.points_m)).normals
    np.testing.assert_allclose(np.linalg.norm(found, axis=1), 1.0, atol=1e-9)
    return np.sum(found * cloud.normals, axis=1)


def torus(around: int = 120, across: int = 40, radius_m: float = 1.0, tube_m: float = 0.35) -> PointCloud:
    a, b = np.meshgrid(2 * np.pi * np.arange(around) / around, 2 * np.pi * np.arange(across) / across)
    a, b = a.ravel() + 0.3 * b.ravel(), b.ravel()
    normals = np.stack([np.cos(a) * np.cos(b), np.sin(a) * np.cos(b), np.sin(b)], axis=1)
    ring_m = radius_m * np.stack([np.cos(a), np.sin(a), np.zeros_like(a)], axis=1)
    return PointCloud(ring_m + tube_m * normals, normals=normals)


@pytest.mark.parametrize("cloud", [sphere(3000), torus(), sphere(60)], ids=["sphere", "torus", "coarse"])
def test_a_closed_shape_is_seen_from_outside(cloud):
    assert agreement(cloud).min() > 0.9


@pytest.mark.parametrize("tube_m", [0.3, 0.45])
def test_a_torus_knot_is_seen_from_outside(tube_m):
    assert (agreement(torus_knot(6000, tube_m)) > 0.5).mean() > 0.999


def test_normals_of_a_lidar_s_rings_are_those_of_the_walls():
    """The twenty nearest points of most lie on one ring, and make no plane."""
    room = lidar_room(16, 0.002)
    found = oriented_normals(PointCloud(room.points_m), np.zeros(3)).normals
    assert (np.sum(found * room.normals, axis=1) > np.cos(np.radians(10.0))).mean() > 0.9


def test_every_separate_part_has_its_own_outside():
    away = rigid(np.eye(3), np.array([3.0, 0.0, 0.0]))
    assert agreement(PointCloud.concatenate([sphere(2000), sphere(2000, 0.1).transformed(away)])).min() > 0.99


@pytest.mark.parametrize("turn", [np.zeros(3), np.array([0.0, 0.0, 2.0]), np.array([0.5, 0.0, 0.0])])
def test_a_flat_cloud_faces_up(turn):
    plane = perforated_plane(1.0, 0.02, 0.2).transformed(rigid(rotation_exp(turn), np.ones(3)))
    np.testing.assert_allclose(agreement(plane), 1.0, atol=1e-9)


def test_a_standing_wall_is_of_one_side():
    wall = perforated_plane(1.0, 0.02, 0.2).transformed(
        rigid(rotation_exp([0.0, np.pi / 2, 0.0]), np.zeros(3))
    )
    np.testing.assert_allclose(agreement(wall), 1.0, atol=1e-9)


def test_the_order_of_the_points_does_not_matter():
    cloud = torus()
    rows = np.random.default_rng(0).permutation(len(cloud))
    first = oriented_normals(PointCloud(cloud.points_m)).normals
    mixed = oriented_normals(PointCloud(cloud.points_m[rows])).normals
    assert np.sum(first[rows] * mixed, axis=1).min() > 0.99


def test_a_viewpoint_decides_where_there_is_one():
    cloud = sphere(2000)
    inwards = oriented_normals(PointCloud(cloud.points_m), np.zeros(3)).normals
    assert np.sum(inwards * cloud.normals, axis=1).max() < -0.99
    place_m = np.array([0.0, 0.0, 5.0])
    seen = turned_to_viewpoint(cloud, place_m)
    assert np.sum(seen.normals * (place_m - cloud.points_m), axis=1).min() >= 0.0
    np.testing.assert_array_equal(np.abs(seen.normals), np.abs(cloud.normals))


@pytest.mark.parametrize("place_m", [None, np.array([0.0, 0.0, 9.0])])
def test_a_cloud_far_from_the_origin_has_the_same_normals(place_m):
    """As in a map's coordinates."""
    cloud, away_m = sphere(2000), np.array([4e5, 5e6, 300.0])
    here = oriented_normals(PointCloud(cloud.points_m), place_m).normals
    seen_from = None if place_m is None else place_m + away_m
    there = oriented_normals(PointCloud(cloud.points_m + away_m), seen_from).normals
    assert np.sum(here * there, axis=1).min() > 0.9999


@pytest.mark.parametrize("place_m", [[0.0, 0.0], [0.0, np.nan, 0.0], [np.inf, 0.0, 0.0]])
def test_a_viewpoint_is_three_numbers(place_m):
    with pytest.raises(InputError, match="three finite numbers X Y Z"):
        turned_to_viewpoint(sphere(50), place_m)


@pytest.mark.parametrize("count", [3, 4, 5])
def test_few_points_are_enough(count):
    normals = oriented_normals(PointCloud(np.random.default_rng(1).normal(size=(count, 3)))).normals
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1.0, atol=1e-9)


def test_two_points_are_too_few():
    with pytest.raises(InputError, match="at least 3 points"):
        oriented_normals(PointCloud(np.zeros((2, 3))))
