"""A line among wrong points: what Tukey's biweight says of it, and where the search for it begins."""

import numpy as np
import pytest

from pipeline.depth.robust import best_random_line, fit_line


def test_the_line_is_where_tukeys_weights_balance_its_residuals():
    """sum w r = sum w r x = 0 with w = (1 - (r / c)^2)^2 and c = 4.685 x 1.4826 MAD (SPEC 3.5)."""
    rng = np.random.default_rng(0)
    x = rng.uniform(1.0, 4.0, 2000)
    y = 1.3 * x + 0.4 + rng.exponential(0.1, len(x)) * x  # far from even
    a, b = fit_line(x, y, rng)
    residual = y - a * x - b
    width = 4.685 * 1.4826 * np.median(np.abs(residual - np.median(residual)))
    weights = np.where(np.abs(residual) < width, (1.0 - (residual / width) ** 2) ** 2, 0.0)
    assert 0.0 < np.mean(weights == 0.0) < 0.1
    assert abs(weights @ residual) < 1e-6 * weights.sum()
    assert abs(weights @ (residual * x)) < 1e-6 * weights.sum()


@pytest.mark.parametrize("level", [6.0, 8.0])
@pytest.mark.parametrize("share", [0.41, 0.47])
def test_a_line_through_little_more_than_half_of_the_points_is_found_exactly(level, share):
    """All others lie on a level line: reweighting from least squares ends between the two."""
    rng = np.random.default_rng(0)
    x = rng.uniform(1.0, 4.0, 2000)
    y = np.where(rng.random(len(x)) < share, level, 2.0 * x + 0.3)
    assert fit_line(x, y, rng) == pytest.approx((2.0, 0.3), abs=1e-9)


def test_of_random_lines_the_one_with_most_points_within_five_per_cent_is_taken():
    """Three in five points lie 3 % off a line far up, the others exactly on one below."""
    rng = np.random.default_rng(0)
    x = rng.uniform(1.0, 4.0, 1000)
    far = rng.random(len(x)) < 0.6
    y = np.where(far, (20.0 * x + 10.0) * rng.uniform(0.97, 1.03, len(x)), 0.5 * x + 1.0)
    slope, intercept = best_random_line(x, y, rng)
    assert np.mean(np.abs(slope * x + intercept - y)[far] < 0.05 * y[far]) > 0.9
