"""Averaging takes noise and steps away, and nothing else."""

import numpy as np
import pytest

from pipeline.acquisition.averaging import averaged
from pipeline.acquisition.planes import FARTHEST_SD, local_planes
from pipeline.types import DepthMap
from tests.pipeline.acquisition.depths import CAMERA, box, in_steps, nearest, sensed, wall


@pytest.mark.parametrize("angle_deg", [0.0, 40.0, 70.0])
def test_an_exact_plane_stays_where_it_is(angle_deg):
    z_m, _ = wall(angle_deg, 2.0)
    depth = DepthMap(np.where((z_m > 0.4) & (z_m < 6.0), z_m, np.nan).astype(np.float32))
    found = averaged(local_planes(depth, CAMERA))
    np.testing.assert_array_equal(found.valid, depth.valid)
    np.testing.assert_allclose(found.z_m, depth.z_m, rtol=2e-4)


@pytest.mark.parametrize("angle_deg", [0.0, 30.0, 50.0])
def test_noise_falls_to_a_third_and_its_mean_stays(angle_deg):
    true_m, normals = wall(angle_deg, 2.5)
    depth = sensed(true_m, normals, 3)
    found = averaged(local_planes(depth, CAMERA))
    inner = depth.valid & (true_m > 1.0) & (true_m < 4.0)
    before, after = ((1.0 / image.z_m[inner] - 1.0 / true_m[inner]) for image in (depth, found))
    assert after.std() < before.std() / 3.0
    assert abs(np.median(after)) < 0.2 * before.std()


def test_steps_become_a_plane():
    true_m, _ = wall(50.0, 2.5)
    depth = in_steps(np.where((true_m > 0.8) & (true_m < 5.0), true_m, np.nan))
    found = averaged(local_planes(depth, CAMERA))
    before, after = (np.abs(1.0 / image.z_m - 1.0 / true_m)[depth.valid].mean() for image in (depth, found))
    assert after < 0.5 * before


def test_no_pixel_moves_beyond_its_noise_and_edges_stay():
    true_m, normals = nearest(wall(30.0, 2.5), box(1.4, slice(60, 180), slice(90, 210)))
    depth = sensed(true_m, normals, 4, flying_share=0.0)
    planes = local_planes(depth, CAMERA)
    found = averaged(planes)
    np.testing.assert_array_equal(found.valid, depth.valid)
    known = depth.valid
    moved = np.abs(1.0 / found.z_m[known] - planes.inverse[known])
    assert np.all(moved <= FARTHEST_SD * planes.sd[known] * (1.0 + 1e-4) + 1e-6)
    between = known & (found.z_m > 1.5) & (found.z_m < 1.7)
    assert not between.any()


def test_the_deviation_of_an_average_is_the_least_that_counts():
    z_m = np.full((CAMERA.height_px, CAMERA.width_px), 2.0, np.float32)
    sd_m = np.full_like(z_m, 0.0001)
    z_m[100, 100], sd_m[100, 100], sd_m[50, 50] = 2.05, 0.1, np.nan
    alone, known = (local_planes(DepthMap(z_m), CAMERA, None, least) for least in (None, sd_m))
    assert known.sd[100, 100] == pytest.approx(0.1 / 2.05**2, rel=1e-3)
    assert known.sd[50, 50] == alone.sd[50, 50]
    assert known.sd[10, 10] == pytest.approx(max(alone.sd[10, 10], 0.0001 / 2.0**2), rel=1e-3)
