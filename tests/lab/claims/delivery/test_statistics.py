"""Slopes and intervals of made-up data whose answers are known."""

import numpy as np
import pytest

from lab.claims.delivery.statistics import grouped_mean, mean_slope, resampled_ci95, slope


def made_up(rates, noise, rng, seeds=5, shares=(1.0, 2.0, 5.0, 10.0)):
    """By rig and seed, pairs whose cost is the rig's rate times the loss, and noise."""
    lost = np.array(shares)
    return [
        [np.column_stack([lost, rate * lost + rng.normal(0, noise, len(lost))]) for _ in range(seeds)]
        for rate in rates
    ]


def test_the_slope_of_a_line_through_the_origin_is_its_slope():
    assert slope(np.array([[1.0, 0.3], [10.0, 3.0]])) == pytest.approx(0.3)
    assert slope(np.array([[5.0, -1.0]])) == pytest.approx(-0.2)


def test_the_slope_is_the_least_squares_one():
    pairs = np.random.default_rng(1).uniform(0, 10, (30, 2))
    best = slope(pairs)
    squares = [np.sum((pairs[:, 1] - rate * pairs[:, 0]) ** 2) for rate in (best - 1e-3, best, best + 1e-3)]
    assert squares[1] == min(squares)


def test_without_a_loss_there_is_no_slope():
    assert np.isnan(slope(np.zeros((3, 2))))


def test_every_rig_counts_alike_however_many_seeds_it_has():
    groups = [[np.array([[1.0, 1.0]])] * 9, [np.array([[1.0, 3.0]])]]
    assert mean_slope(groups) == pytest.approx(2.0)
    assert grouped_mean([[1.0] * 9, [3.0]]) == 2.0


def test_exact_data_have_an_interval_of_no_width():
    groups = made_up([0.4] * 4, 0.0, np.random.default_rng(0))
    assert resampled_ci95(groups, mean_slope) == pytest.approx((0.4, 0.4))


def test_the_interval_covers_the_mean_rate_of_many_rigs_about_95_times_of_100():
    rng = np.random.default_rng(7)
    covered = 0
    for _ in range(100):
        groups = made_up(rng.normal(0.5, 0.2, 15), 0.1, rng, seeds=3)
        low, high = resampled_ci95(groups, mean_slope, resamples=200)
        covered += low <= 0.5 <= high
    assert covered >= 85


def test_seeds_that_share_a_rig_are_no_new_rigs():
    rng = np.random.default_rng(3)
    groups = made_up([0.1, 0.3, 0.5, 0.7], 0.01, rng, seeds=50)
    by_rig = np.ptp(resampled_ci95(groups, mean_slope))
    pooled = np.ptp(resampled_ci95([[pairs] for group in groups for pairs in group], mean_slope))
    assert by_rig > 3 * pooled


def test_an_interval_repeats():
    groups = made_up([0.1, 0.3], 0.1, np.random.default_rng(2))
    assert resampled_ci95(groups, mean_slope, resamples=50) == resampled_ci95(
        groups, mean_slope, resamples=50
    )
