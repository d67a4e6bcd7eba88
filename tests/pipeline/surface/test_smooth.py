"""Smoothing: what it must take away and what it must leave."""

import numpy as np
import pytest

from pipeline.kernels.geometry import rigid, rotation_exp
from pipeline.surface.smooth import smooth
from pipeline.types import PointCloud


def plane(noise_m: float, seed: int = 0) -> PointCloud:
    rng = np.random.default_rng(seed)
    points_m = np.zeros((2500, 3))
    points_m[:, :2] = rng.uniform(-1, 1, (2500, 2))
    points_m[:, 2] = rng.normal(0, noise_m, 2500)
    return PointCloud(points_m, normals=np.tile([0.0, 0.0, 1.0], (2500, 1)))


def test_a_plane_stays_where_it_is():
    cloud = plane(0.0)
    moved = smooth(cloud, 3)
    np.testing.assert_allclose(moved.points_m, cloud.points_m, atol=1e-12)
    np.testing.assert_allclose(moved.normals, cloud.normals, atol=1e-9)


def test_noise_shrinks_with_every_pass_and_points_keep_their_place_along_the_surface():
    clouds = [smooth(plane(0.01), passes) for passes in (0, 1, 2)]
    noise_m = [np.std(cloud.points_m[:, 2]) for cloud in clouds]
    assert noise_m[1] < 0.5 * noise_m[0]
    assert noise_m[2] < noise_m[1]
    shift_m = np.linalg.norm(clouds[2].points_m[:, :2] - clouds[0].points_m[:, :2], axis=1)
    assert np.quantile(shift_m, 0.99) < 0.005


def test_normals_stay_unit_and_on_their_side():
    cloud = smooth(plane(0.01), 2)
    np.testing.assert_allclose(np.linalg.norm(cloud.normals, axis=1), 1.0, atol=1e-12)
    assert np.all(cloud.normals[:, 2] > 0.7)


def test_smoothing_commutes_with_a_rigid_motion():
    T = rigid(rotation_exp([0.3, -1.0, 0.5]), [1.0, 2.0, -0.5])
    cloud = plane(0.01)
    np.testing.assert_allclose(
        smooth(cloud.transformed(T), 2).points_m, smooth(cloud, 2).transformed(T).points_m, atol=1e-9
    )


def test_no_pass_changes_nothing():
    cloud = plane(0.01)
    assert smooth(cloud, 0) is cloud


@pytest.mark.parametrize("count", [1, 3, 5])
def test_a_handful_of_points_is_no_error(count):
    cloud = plane(0.01).select(np.arange(count))
    assert len(smooth(cloud, 1)) == count
