"""Every lens against OpenCV's projection, and the limits of each model worked out on paper."""

from dataclasses import replace

import numpy as np
import pytest

from pipeline.kernels.geometry import has_ray, pixel_rays, project, undistorted_rays
from pipeline.kernels.lens import reach
from pipeline.types import CameraIntrinsics
from tests.pipeline.lenses import KIND, by_opencv, camera

PIXELS = np.stack(np.meshgrid(np.arange(320.0), np.arange(240.0)), axis=-1).reshape(-1, 2)


def points_before(intrinsics, count=2000):
    """(N, 3) points that a lens sees in and around its image."""
    rng = np.random.default_rng(3)
    widest = 0.75 if not intrinsics.fisheye else 1.4
    flat = np.tan(rng.uniform(0.0, widest, count))[:, None] * _directions(rng, count)
    return np.column_stack([flat, np.ones(count)]) * rng.uniform(0.3, 5.0, (count, 1))


def _directions(rng, count):
    angle = rng.uniform(0.0, 2.0 * np.pi, count)
    return np.stack([np.cos(angle), np.sin(angle)], axis=1)


@pytest.mark.parametrize("kind", KIND)
def test_points_have_the_pixels_that_opencv_gives_them(kind):
    points_m = points_before(camera(kind))
    np.testing.assert_allclose(
        project(camera(kind), points_m), by_opencv(camera(kind), points_m), rtol=0, atol=1e-6
    )


@pytest.mark.parametrize("kind", KIND)
def test_the_ray_of_every_pixel_leads_back_to_it(kind):
    rays = undistorted_rays(camera(kind), PIXELS)
    assert np.isfinite(rays).all()
    np.testing.assert_array_equal(rays[:, 2], 1.0)
    np.testing.assert_allclose(by_opencv(camera(kind), rays * 1.7), PIXELS, rtol=0, atol=1e-6)
    np.testing.assert_array_equal(pixel_rays(camera(kind)).reshape(-1, 3), rays)


@pytest.mark.parametrize("kind", KIND)
def test_the_pixel_of_every_point_leads_back_to_it(kind):
    points_m = points_before(camera(kind))
    rays = undistorted_rays(camera(kind), by_opencv(camera(kind), points_m))
    np.testing.assert_allclose(rays, points_m / points_m[:, 2:], rtol=1e-6, atol=1e-9)


def folding():
    """r (1 - r² / 3) is largest at r = 1, where it is 2 / 3: at 100 px."""
    pinhole = CameraIntrinsics.pinhole(150.0, 150.0, 159.5, 119.5, 320, 240)
    return replace(pinhole, distortion=np.array([-1.0 / 3.0, 0.0, 0.0, 0.0, 0.0]))


def test_beyond_the_fold_of_a_lens_there_is_neither_ray_nor_pixel():
    assert reach(folding()) == pytest.approx(1.0)
    rays = undistorted_rays(folding(), [[159.5 + 99.9, 119.5], [159.5 + 100.1, 119.5]])
    assert 0.9 < rays[0, 0] < 1.0
    assert np.isnan(rays[1]).all()
    distance_px = np.hypot(*(PIXELS - (159.5, 119.5)).T).reshape(240, 320)
    np.testing.assert_array_equal(has_ray(folding()), distance_px < 100.0)
    pixels = project(folding(), np.array([[0.99, 0.0, 1.0], [1.01, 0.0, 1.0], [0.0, -3.4, 2.0]]))
    assert 0.0 < pixels[0, 0] < 320.0
    assert np.isnan(pixels[1:]).all()


def test_near_its_fold_where_opencvs_iteration_does_not_converge_a_pixel_has_its_ray():
    """r (1 - r² / 3) at r = 0.98 is 0.98 - 0.98³ / 3."""
    bent = 0.98 - 0.98**3 / 3.0
    ray = undistorted_rays(folding(), [[159.5, 119.5 - 150.0 * bent]])
    np.testing.assert_allclose(ray, [[0.0, -0.98, 1.0]], atol=1e-7)


def test_the_pole_of_a_rational_lens_limits_it():
    """The denominator 1 - r² / 4 is 0 at r = 2; with the numerator 1, r / (1 - r² / 4) grows up to there."""
    pinhole = CameraIntrinsics.pinhole(100.0, 100.0, 159.5, 119.5, 320, 240)
    pole = replace(pinhole, distortion=np.array([0.0, 0.0, 0.0, 0.0, 0.0, -0.25, 0.0, 0.0]))
    assert reach(pole) == pytest.approx(2.0)
    pixels = project(pole, np.array([[1.0, 0.0, 1.0], [2.5, 0.0, 1.0]]))
    np.testing.assert_allclose(pixels[0], (159.5 + 100.0 / 0.75, 119.5))
    assert np.isnan(pixels[1]).all()


@pytest.mark.parametrize("k1", [0.0, 0.03])
def test_a_fisheye_sees_up_to_90_degrees_and_its_pixels_beyond_have_no_ray(k1):
    wide = CameraIntrinsics(
        np.array([[90.0, 0, 160], [0, 90.0, 120], [0, 0, 1]]), np.array([k1, 0, 0, 0]), 320, 240, True
    )
    angles = np.radians([10.0, 60.0, 89.0, 91.0, 100.0])
    columns = 160.0 + 90.0 * (angles + k1 * angles**3)
    rays = undistorted_rays(wide, np.column_stack([columns, np.full(5, 120.0)]))
    np.testing.assert_allclose(rays[:3, 0], np.tan(angles[:3]), rtol=1e-9)
    assert np.isnan(rays[3:]).all()


def test_a_fisheye_s_middle_and_a_lens_without_coefficients_are_exact():
    ray = undistorted_rays(camera("fisheye"), camera("fisheye").matrix[None, :2, 2])
    np.testing.assert_array_equal(ray, [[0.0, 0.0, 1.0]])
    zero = replace(camera("rational"), distortion=np.zeros(8))
    plain = replace(zero, distortion=np.zeros(5))
    np.testing.assert_array_equal(pixel_rays(zero), pixel_rays(plain))


def test_a_fisheye_and_another_lens_with_the_same_numbers_have_rays_of_their_own():
    pinhole = CameraIntrinsics.pinhole(90.0, 90.0, 159.5, 119.5, 320, 240)
    equidistant = replace(pinhole, distortion=np.zeros(4), fisheye=True)
    other = replace(pinhole, distortion=np.zeros(4))
    assert not np.allclose(pixel_rays(equidistant), pixel_rays(other), equal_nan=True)


@pytest.mark.parametrize("k3", [5e-324, 1e-307])
def test_a_coefficient_next_to_nothing_is_nothing(k3):
    """As damaged files have it: no root of the polynomial overflows."""
    matrix = np.array([[100.0, 0.0, 40.0], [0.0, 100.0, 30.0], [0.0, 0.0, 1.0]])
    reaches = [
        reach(CameraIntrinsics(matrix, np.array([-0.2, 0.0, 0.0, 0.0, last]), 80, 60)) for last in (0.0, k3)
    ]
    assert reaches[0] == reaches[1] == pytest.approx(np.sqrt(1.0 / 0.6))
