"""Slopes and intervals of made-up data whose answers are known."""

import numpy as np
import pytest

from lab.claims.delivery.statistics import difference, estimate, mean_terms, resampled_ci95, slope_terms

LOST = np.array([1.0, 2.0, 5.0, 10.0])


def made_up(rates, noise, rng, seeds=5):
    """By rig and seed, the terms of costs that are the rig's rate times the loss, and noise."""
    return [
        np.stack([slope_terms(LOST, rate * LOST + rng.normal(0, noise, len(LOST))) for _ in range(seeds)])
        for rate in rates
    ]


def slope(lost, cost):
    return np.divide(*slope_terms(lost, cost))


def test_the_slope_of_a_line_through_the_origin_is_its_slope():
    assert slope([1.0, 10.0], [0.3, 3.0]) == pytest.approx(0.3)
    assert slope([5.0], [-1.0]) == pytest.approx(-0.2)


def test_the_slope_is_the_least_squares_one():
    lost, cost = np.random.default_rng(1).uniform(0, 10, (2, 30))
    best = slope(lost, cost)
    squares = [np.sum((cost - rate * lost) ** 2) for rate in (best - 1e-3, best, best + 1e-3)]
    assert squares[1] == min(squares)


def test_every_rig_counts_alike_however_many_seeds_it_has():
    assert estimate([mean_terms([1.0] * 9), mean_terms([3.0])])[0] == 2.0


def test_all_losses_of_a_rig_are_one_line():
    halves = [slope_terms(LOST[:2], [0.1, 0.4]), slope_terms(LOST[2:], [0.5, 2.0])]
    assert estimate([np.stack(halves)])[0] == pytest.approx(slope(LOST, [0.1, 0.4, 0.5, 2.0]))


def test_exact_data_have_an_interval_of_no_width():
    value, ci95 = estimate(made_up([0.4] * 4, 0.0, np.random.default_rng(0)))
    assert value == pytest.approx(0.4)
    assert ci95 == pytest.approx((0.4, 0.4))


def test_the_interval_covers_the_mean_rate_of_many_rigs_about_95_times_of_100():
    rng = np.random.default_rng(7)
    covered = 0
    for _ in range(100):
        low, high = resampled_ci95(made_up(rng.normal(0.5, 0.2, 15), 0.1, rng, seeds=3), resamples=200)
        covered += low <= 0.5 <= high
    assert 0.85 <= covered / 100 <= 0.99


def test_seeds_that_share_a_rig_are_no_new_rigs():
    groups = made_up([0.1, 0.3, 0.5, 0.7], 0.01, np.random.default_rng(3), seeds=20)
    by_rig = np.ptp(resampled_ci95(groups))
    pooled = np.ptp(resampled_ci95([terms[None] for group in groups for terms in group], resamples=300))
    assert by_rig > 3 * pooled


def test_seeds_alone_have_an_interval_too():
    one_rig = made_up([0.5], 0.5, np.random.default_rng(4))
    assert np.ptp(resampled_ci95(one_rig)) > 0.0


def test_two_codings_are_compared_on_the_same_rigs():
    rng, rates = np.random.default_rng(5), np.array([0.1, 0.5, 0.9, 1.3])
    worse, better = made_up(rates + 0.05, 0.0, rng), made_up(rates, 0.0, rng)
    value, (low, high) = estimate([np.hstack(both) for both in zip(worse, better, strict=True)], difference)
    assert (value, low, high) == pytest.approx((0.05, 0.05, 0.05))


def test_an_interval_repeats():
    groups = made_up([0.1, 0.3], 0.1, np.random.default_rng(2))
    assert resampled_ci95(groups) == resampled_ci95(groups)
