from dataclasses import replace

import numpy as np
import pytest

from packetmesh.errors import InputError
from pipeline.acquisition import back_project, depth_sigma_m
from pipeline.config import RegistrationConfig
from pipeline.kernels.geometry import project
from pipeline.registration.ceicp import CeicpA
from pipeline.types import CameraIntrinsics, DepthMap, DepthNoise, PointSource, RgbdFrame

WIDTH_PX, HEIGHT_PX = 64, 48


def _frame(z_m, distortion=(0.0, 0.0, 0.0, 0.0, 0.0)) -> RgbdFrame:
    matrix = np.array([[57.0, 0.0, 31.2], [0.0, 58.0, 24.1], [0.0, 0.0, 1.0]])
    height_px, width_px = z_m.shape
    rgb = np.random.default_rng(0).integers(0, 256, (height_px, width_px, 3), dtype=np.uint8)
    intrinsics = CameraIntrinsics(matrix, np.array(distortion), WIDTH_PX, HEIGHT_PX)
    return RgbdFrame("node_00", rgb, DepthMap(z_m.astype(np.float32)), intrinsics, np.eye(4))


def _holed_depth() -> np.ndarray:
    rng = np.random.default_rng(1)
    z_m = rng.uniform(0.6, 4.0, (HEIGHT_PX, WIDTH_PX))
    z_m[rng.uniform(size=z_m.shape) < 0.3] = np.nan
    return z_m


@pytest.mark.parametrize(
    "distortion",
    [(0.0,) * 5, (0.05, 0.1, 0.0, 0.0, 0.0), (-0.25, 0.08, 0.001, -0.002, -0.01)],
    ids=["pinhole", "thesis", "kinect"],
)
def test_projecting_the_points_gives_their_pixels(distortion):
    frame = _frame(_holed_depth(), distortion)
    cloud = back_project(frame)
    np.testing.assert_allclose(project(frame.intrinsics, cloud.points_m), cloud.pixels, atol=1e-9)


def test_every_known_pixel_becomes_a_point_with_its_depth_and_colour():
    frame = _frame(_holed_depth())
    cloud = back_project(frame)
    u, v = cloud.pixels.T
    assert len(cloud) == np.count_nonzero(frame.depth.valid)
    assert len(np.unique(cloud.pixels, axis=0)) == len(cloud)
    np.testing.assert_array_equal(cloud.points_m[:, 2].astype(np.float32), frame.depth.z_m[v, u])
    np.testing.assert_array_equal(cloud.colors, frame.rgb[v, u])
    np.testing.assert_allclose(cloud.sigma_m, depth_sigma_m(cloud.points_m[:, 2]))
    assert (cloud.source == PointSource.SENSOR).all()


def test_inferred_depth_is_labelled_and_claims_no_sensor_accuracy():
    frame = _frame(_holed_depth())
    dense = DepthMap(np.full((HEIGHT_PX, WIDTH_PX), 2.0, dtype=np.float32))
    cloud = back_project(frame, dense, PointSource.INFERRED)
    assert len(cloud) == HEIGHT_PX * WIDTH_PX
    assert (cloud.source == PointSource.INFERRED).all()
    assert cloud.sigma_m is None


def test_kinect_noise_grows_with_depth():
    np.testing.assert_allclose(depth_sigma_m(np.array([0.4, 1.4, 4.4])), [0.0012, 0.0031, 0.0316])


@pytest.mark.parametrize("value", [np.nan, 0.0, -1.0, np.inf])
def test_depth_without_a_valid_pixel(value):
    with pytest.raises(InputError, match="node_00 has no valid pixel; check the file and the depth scale"):
        back_project(_frame(np.full((HEIGHT_PX, WIDTH_PX), value)))


def test_sizes_that_do_not_match():
    frame = _frame(_holed_depth())
    half = DepthMap(np.ones((HEIGHT_PX // 2, WIDTH_PX // 2), dtype=np.float32))
    with pytest.raises(InputError, match="32 x 24, but its colour image is 64 x 48"):
        back_project(frame, half)
    small = replace(frame, rgb=frame.rgb[:24, :32], depth=half)
    with pytest.raises(InputError, match="32 x 24, but its intrinsics are for 64 x 48"):
        back_project(small)


def test_relative_depth_is_refused():
    frame = _frame(_holed_depth())
    with pytest.raises(InputError, match="relative"):
        back_project(frame, replace(frame.depth, kind="relative"))


def test_a_calibrated_sensor_s_noise_is_that_of_its_points_and_widens_the_last_scale_of_registration():
    frame = _frame(_holed_depth())
    noise = DepthNoise(0.004, 0.05, 2.0, 0.5)
    cloud = back_project(replace(frame, noise=noise))
    np.testing.assert_allclose(cloud.sigma_m, noise.sd_m(cloud.points_m[:, 2]))
    np.testing.assert_array_equal(cloud.points_m, back_project(frame).points_m)
    smallest_m = CeicpA.starting(RegistrationConfig(), cloud, cloud).sigma_min_m
    assert smallest_m == np.median(cloud.sigma_m)
