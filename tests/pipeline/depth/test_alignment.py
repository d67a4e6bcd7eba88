import numpy as np
import pytest

from packetmesh.errors import InputError, ReconstructionError
from pipeline.depth import align_depth
from pipeline.depth.alignment import corrected
from pipeline.types import DepthMap

HEIGHT_PX, WIDTH_PX = 120, 160
MODES = ["none", "median", "affine_depth", "affine_inverse", "local"]


@pytest.fixture
def truth_m() -> np.ndarray:
    """A slanted floor with two boxes on it, 1 to 4 m away."""
    v, u = np.mgrid[:HEIGHT_PX, :WIDTH_PX]
    z_m = 4.0 - 2.0 * v / HEIGHT_PX + 0.3 * np.sin(u / 30.0)
    z_m[40:80, 20:60] = 1.4
    z_m[60:100, 90:130] = 1.1 + 0.002 * u[60:100, 90:130]
    return z_m


def _sensor(truth_m: np.ndarray, outliers: float = 0.0, holes: float = 0.2) -> DepthMap:
    rng = np.random.default_rng(3)
    z_m = np.where(rng.random(truth_m.shape) < outliers, rng.uniform(0.5, 8.0, truth_m.shape), truth_m)
    return DepthMap(np.where(rng.random(truth_m.shape) < holes, np.nan, z_m).astype(np.float32))


@pytest.mark.parametrize("outliers", [0.0, 0.3])
def test_affine_depth_recovers_the_line_exactly(truth_m, outliers):
    inferred = DepthMap(((truth_m - 0.25) / 1.3).astype(np.float32), "relative")
    result = align_depth(inferred, _sensor(truth_m, outliers), "affine_depth")
    assert result.coefficients == pytest.approx({"a": 1.3, "b": 0.25}, abs=1e-5)
    np.testing.assert_allclose(result.depth.z_m, truth_m, rtol=1e-5)
    assert result.inliers >= 0.99 * (1.0 - outliers)


@pytest.mark.parametrize("outliers", [0.0, 0.3])
def test_affine_inverse_recovers_the_line_of_disparities_exactly(truth_m, outliers):
    inferred = DepthMap((0.7 / (1.0 / truth_m - 0.05)).astype(np.float32), "relative")
    result = align_depth(inferred, _sensor(truth_m, outliers), "affine_inverse")
    assert result.coefficients == pytest.approx({"a": 0.7, "b": 0.05}, abs=1e-5)
    np.testing.assert_allclose(result.depth.z_m, truth_m, rtol=1e-5)


def test_median_recovers_a_scale_among_outliers(truth_m):
    inferred = DepthMap((truth_m / 2.5).astype(np.float32), "relative")
    result = align_depth(inferred, _sensor(truth_m), "median")
    assert result.coefficients["scale"] == pytest.approx(2.5, rel=0.01)


def test_local_removes_a_smooth_bias_that_a_line_cannot(truth_m):
    v, u = np.mgrid[:HEIGHT_PX, :WIDTH_PX]
    bias = np.exp(0.12 * np.sin(2.0 * np.pi * u / 110.0) * np.cos(2.0 * np.pi * v / 130.0))
    inferred = DepthMap((truth_m * bias).astype(np.float32), "relative")
    sensor_m = truth_m.copy()
    sensor_m[50:74, 60:90] = np.nan
    hole = np.isnan(sensor_m)
    error = {}
    for mode in ("affine_depth", "local"):
        z_m = align_depth(inferred, DepthMap(sensor_m.astype(np.float32)), mode).depth.z_m
        error[mode] = np.mean(np.abs(z_m / truth_m - 1.0)[hole])
    everywhere = np.mean(np.abs(z_m / truth_m - 1.0))
    assert everywhere < 0.02
    assert error["local"] < 0.5 * error["affine_depth"]


@pytest.mark.parametrize(("residual", "kept"), [(0.3, 0.3), (2.0, 0.5), (-2.0, -0.5)])
def test_a_local_correction_follows_a_residual_up_to_a_half_either_way(truth_m, residual, kept):
    everywhere = np.ones(truth_m.shape, bool)
    found_m = corrected(truth_m * np.exp(-residual), truth_m, everywhere)
    np.testing.assert_allclose(np.log(found_m / truth_m), kept - residual, atol=1e-3)


@pytest.mark.parametrize("mode", MODES)
def test_perfect_depth_stays_as_it_is(truth_m, mode):
    result = align_depth(DepthMap(truth_m.astype(np.float32)), _sensor(truth_m), mode)
    np.testing.assert_allclose(result.depth.z_m, truth_m, rtol=0.02 if mode == "median" else 1e-5)
    assert result.depth.kind == "metric"
    assert result.depth.coverage == 1.0


@pytest.mark.parametrize("mode", MODES)
def test_aligning_fills_the_sensors_holes_and_keeps_the_inferred_ones(truth_m, mode):
    inferred_m = 1.1 * truth_m + 0.1
    inferred_m[:, :10] = np.nan
    result = align_depth(DepthMap(inferred_m.astype(np.float32), "relative"), _sensor(truth_m), mode)
    assert np.isnan(result.depth.z_m[:, :10]).all()
    assert np.isfinite(result.depth.z_m[:, 10:]).all()
    assert result.depth.z_m.dtype == np.float32


@pytest.mark.parametrize("mode", MODES[1:])
def test_the_unit_of_the_inferred_depth_does_not_matter(truth_m, mode):
    noisy = truth_m * np.exp(np.random.default_rng(5).normal(0.0, 0.05, truth_m.shape))
    small, large = (align_depth(DepthMap(s * noisy), _sensor(truth_m), mode).depth.z_m for s in (1.0, 40.0))
    np.testing.assert_allclose(small, large, rtol=1e-4)


def test_same_input_same_bits(truth_m):
    inferred = DepthMap((truth_m**1.5).astype(np.float32), "relative")
    first, second = (align_depth(inferred, _sensor(truth_m, 0.5), "local").depth.z_m for _ in range(2))
    assert first.tobytes() == second.tobytes()


def test_a_depth_that_would_turn_negative_becomes_unknown(truth_m):
    inferred_m = truth_m.copy()
    inferred_m[0, 0] = 1e-3
    sensor = DepthMap((2.0 * truth_m - 1.5).astype(np.float32))
    z_m = align_depth(DepthMap(inferred_m.astype(np.float32)), sensor, "affine_depth").depth.z_m
    assert np.isnan(z_m[0, 0])
    assert (z_m[np.isfinite(z_m)] > 0.0).all()


def test_a_disparity_as_good_as_zero_leaves_the_depth_unknown(truth_m):
    inferred_m = truth_m.copy()
    inferred_m[0, :5] = 1e3
    sensor = DepthMap((1.0 / (1.2 / truth_m - 0.01)).astype(np.float32))
    z_m = align_depth(DepthMap(inferred_m.astype(np.float32)), sensor, "affine_inverse").depth.z_m
    assert np.isnan(z_m[0, :5]).all()
    assert np.isfinite(z_m[1:]).all()


def test_a_depth_from_disparity_is_known_up_to_three_times_the_sensors_farthest(truth_m):
    sensor_m, inferred_m = truth_m.copy(), truth_m.copy()
    sensor_m[0, :2] = np.nan
    inferred_m[0, :2] = np.nanmax(sensor_m) * np.array([2.99, 3.01])
    result = align_depth(DepthMap(inferred_m), DepthMap(sensor_m), "affine_inverse")
    assert result.depth.z_m[0, 0] == pytest.approx(inferred_m[0, 0], rel=1e-5)
    assert np.isnan(result.depth.z_m[0, 1])


def test_a_flat_wall_determines_a_scale_only(truth_m):
    flat = DepthMap(np.full_like(truth_m, 2.0, dtype=np.float32))
    result = align_depth(flat, DepthMap(np.full_like(truth_m, 3.0, dtype=np.float32)), "affine_depth")
    assert result.coefficients == {"a": 1.5, "b": 0.0}


@pytest.mark.parametrize("mode", MODES[1:])
def test_hardly_any_overlap_is_refused(truth_m, mode):
    sensor_m = np.full(truth_m.shape, np.nan, np.float32)
    sensor_m[0, :99] = 2.0
    with pytest.raises(ReconstructionError, match="share only 99 pixels"):
        align_depth(DepthMap(truth_m.astype(np.float32)), DepthMap(sensor_m), mode)


def test_no_overlap_is_enough_for_no_alignment(truth_m):
    sensor = DepthMap(np.full(truth_m.shape, np.nan, np.float32))
    result = align_depth(DepthMap(truth_m.astype(np.float32)), sensor, "none")
    assert np.isnan(result.residual_rms_m)
    assert result.inliers == 0.0


def test_maps_of_different_size_are_refused(truth_m):
    with pytest.raises(InputError, match="160 x 120"):
        align_depth(DepthMap(truth_m), DepthMap(truth_m[1:]), "median")
