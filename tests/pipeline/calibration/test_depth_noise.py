"""The noise law from points that follow one exactly, and the noise of pixels drawn from a known one."""

import numpy as np
import pytest

from pipeline.calibration.depth_noise import BENDS, CLIP_SDS, NoisePoints, noise_law, noise_points
from pipeline.calibration.depth_samples import DepthSamples
from pipeline.types import DepthNoise


def test_a_law_whose_bend_is_tried_is_found_exactly():
    """0.001 m up to the tenth place of the bend, then as z^2; all over cos^0.7."""
    log_z = np.linspace(0.0, 0.05 * BENDS, 61)
    law = DepthNoise(0.001, 0.001 * np.exp(-2.0 * 0.5), 2.0, 0.7)
    z_m, cosine = np.exp(log_z), np.tile([1.0, 0.8, 0.6], 61)[:61]
    found = noise_law(NoisePoints(z_m, cosine, law.sd_m(z_m, cosine), np.zeros(61)))
    for name in ("s0_m", "s1_m", "p", "q"):
        assert getattr(found, name) == pytest.approx(getattr(law, name), rel=1e-9), name


def test_noise_that_does_not_grow_has_exponents_of_zero_and_not_below():
    z_m = np.linspace(1.0, 3.0, 40)
    found = noise_law(NoisePoints(z_m, np.full(40, 0.9), 0.004 / z_m, np.zeros(40)))
    assert (found.p, found.q) == (0.0, 0.0)
    assert found.s0_m == pytest.approx(np.exp(np.mean(np.log(0.004 / z_m))))


def test_no_exponent_is_above_the_limit_and_the_law_then_fits_at_that_limit():
    z_m = np.geomspace(1.0, 3.0, 40)
    found = noise_law(NoisePoints(z_m, np.ones(40), 0.001 * z_m**6, np.zeros(40)))
    assert found.p == 4.0
    off = np.log(found.sd_m(z_m, np.ones(40)) / (0.001 * z_m**6))
    assert np.mean(off) == pytest.approx(0.0, abs=1e-9)
    assert np.abs(off).max() == pytest.approx(np.log(3.0), rel=1e-6)  # 2 log(3) from end to end


def test_noise_is_what_is_left_of_a_views_plane_without_what_is_four_sds_off():
    rng = np.random.default_rng(0)
    pixels = rng.integers(0, (640, 480), (8000, 2))
    residuals_m = rng.normal(0.0, 0.002, 8000) + 0.05 + 1e-4 * pixels[:, 0] - 2e-4 * pixels[:, 1]
    residuals_m[::100] += 1.0
    true_m, cosine = rng.uniform(1.0, 2.0, 8000), np.full(8000, 0.8)
    nothing = np.zeros(8000, int)
    samples = DepthSamples(
        (640, 480), pixels, true_m, true_m, cosine, nothing, nothing > 0, ("a",), np.zeros((0, 8000)), nothing
    )
    found = noise_points(samples, residuals_m)
    np.testing.assert_allclose(found.sd_m, 0.002, rtol=0.07)
    np.testing.assert_allclose(found.z_m, [1.125, 1.375, 1.625, 1.875], atol=0.02)
    assert CLIP_SDS == 4.0
