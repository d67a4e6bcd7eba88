import numpy as np
import pytest

from packetmesh.errors import InputError
from pipeline.depth.fillers import COLOR_SIGMA, LEAST_WEIGHT, PEERS, SPACE_SIGMA_PX, WINDOW_PX, weighted_means
from pipeline.types import DepthMap

HEIGHT_PX, WIDTH_PX = 60, 80


def grey(level: int = 120) -> np.ndarray:
    return np.full((HEIGHT_PX, WIDTH_PX, 3), level, np.uint8)


def with_hole(z_m: np.ndarray) -> DepthMap:
    z_m = z_m.astype(np.float32)
    z_m[20:40, 30:50] = np.nan
    return DepthMap(z_m)


@pytest.mark.parametrize("name", PEERS)
def test_fills_are_dense_and_keep_measured_pixels_to_the_last_bit(name):
    rng = np.random.default_rng(0)
    sensor = with_hole(2.0 + 0.3 * rng.random((HEIGHT_PX, WIDTH_PX)))
    filled = PEERS[name](sensor, rng.integers(0, 255, (HEIGHT_PX, WIDTH_PX, 3)).astype(np.uint8))
    assert filled.coverage == 1.0
    assert filled.z_m.dtype == np.float32
    np.testing.assert_array_equal(filled.z_m[sensor.valid], sensor.z_m[sensor.valid])


@pytest.mark.parametrize("name", PEERS)
@pytest.mark.parametrize("depth_m", [0.4, 1.0, 7.3])
def test_a_hole_in_a_flat_wall_is_filled_to_a_millimetre(name, depth_m):
    filled = PEERS[name](with_hole(np.full((HEIGHT_PX, WIDTH_PX), depth_m)), grey())
    np.testing.assert_allclose(filled.z_m, depth_m, atol=1e-3)


@pytest.mark.parametrize("name", PEERS)
def test_a_hole_in_a_slanted_wall_is_filled_from_its_rim(name):
    wall_m = np.tile(np.linspace(1.0, 1.8, WIDTH_PX), (HEIGHT_PX, 1))
    filled = PEERS[name](with_hole(wall_m), grey())
    hole = np.s_[20:40, 30:50]
    assert filled.z_m[hole].min() >= wall_m[0, 29] - 0.03
    assert filled.z_m[hole].max() <= wall_m[0, 50] + 0.03


def test_nearest_takes_the_nearest_measured_depth_exactly():
    z_m = np.full((HEIGHT_PX, WIDTH_PX), np.nan, np.float32)
    z_m[5, 10], z_m[50, 70] = 1.25, 3.5
    v, u = np.mgrid[:HEIGHT_PX, :WIDTH_PX]
    first = np.hypot(v - 5, u - 10), np.hypot(v - 50, u - 70)
    clear = np.abs(first[0] - first[1]) > 2.0
    filled = PEERS["nearest"](DepthMap(z_m), grey()).z_m
    np.testing.assert_array_equal(filled[clear], np.where(first[0] < first[1], 1.25, 3.5)[clear])


def test_joint_bilateral_follows_the_colours_across_a_hole():
    z_m, rgb = np.full((HEIGHT_PX, WIDTH_PX), 3.0), grey(200)
    z_m[:, 40:], rgb[:, 40:] = 1.0, 40
    filled = PEERS["joint-bilateral"](with_hole(z_m), rgb).z_m
    assert np.mean(np.abs(filled - z_m) < 0.05) >= 0.99


@pytest.mark.parametrize("name", PEERS)
def test_a_frame_without_depth_is_refused(name):
    with pytest.raises(InputError, match="no valid pixel"):
        PEERS[name](DepthMap(np.full((HEIGHT_PX, WIDTH_PX), np.nan, np.float32)), grey())


def test_a_bilateral_mean_weighs_distance_in_the_image_and_in_colour():
    """Two known pixels around an unknown one: 2 m at (2, -3) in its colour, 3 m at (1, 0) in another."""
    size = 2 * WINDOW_PX + 1
    z_m, colors = np.zeros((size, size), np.float32), np.zeros((size, size, 3), np.float32)
    known, at = np.zeros((size, size), bool), WINDOW_PX
    for down, right, depth_m, levels in ((2, -3, 2.0, 0.0), (1, 0, 3.0, 30.0)):
        z_m[at + down, at + right], known[at + down, at + right] = depth_m, True
        colors[at + down, at + right] = levels
    near = np.exp(-13.0 / (2.0 * SPACE_SIGMA_PX**2)) * (1.0 + LEAST_WEIGHT)
    other = np.exp(-1.0 / (2.0 * SPACE_SIGMA_PX**2)) * (
        np.exp(-900.0 / (2.0 * COLOR_SIGMA**2)) + LEAST_WEIGHT
    )
    mean_m = weighted_means(z_m, known, colors, np.array([at]), np.array([at]))
    assert mean_m == pytest.approx((2.0 * near + 3.0 * other) / (near + other), rel=1e-5)
