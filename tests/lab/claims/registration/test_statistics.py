"""The statistics against SciPy and against sums done by hand."""

import numpy as np
import pytest
from scipy.stats import wilcoxon

from lab.claims.claim import bootstrap_ci95
from lab.claims.registration.statistics import Comparison, compare, holm, holm_p


def test_holm_by_hand():
    """Sorted .01, .02, .03, .04 times 4, 3, 2, 1, never falling: .04, .06, .06, .06."""
    for p, adjusted in (
        ([0.04, 0.01, 0.03, 0.02], [0.06, 0.04, 0.06, 0.06]),
        ([0.9, 0.6], [1.0, 1.0]),
        ([], []),
        ([0.02], [0.02]),
    ):
        assert holm_p(np.array(p)) == pytest.approx(adjusted)


def test_holm_keeps_the_order_and_everything_but_p():
    rows = [Comparison(name, 0.5, 0.7, p, 9) for name, p in (("a", 0.04), ("b", 0.001), ("c", 0.2))]
    corrected = holm(rows)
    assert [c.rival for c in corrected] == ["a", "b", "c"]
    assert [c.p for c in corrected] == pytest.approx([0.08, 0.003, 0.2])
    assert [c.ratio for c in corrected] == [0.5, 0.5, 0.5]


def test_a_comparison_agrees_with_scipy():
    rng = np.random.default_rng(1)
    theirs = rng.lognormal(0.0, 0.5, 40)
    ours = theirs * rng.lognormal(-0.2, 0.4, 40)
    found = compare("rival", ours, theirs)
    assert found.p == wilcoxon(np.log(ours / theirs)).pvalue
    assert found.ratio == pytest.approx(np.median(ours / theirs), rel=0.02)
    assert found.win_rate == np.mean(ours < theirs)
    assert found.outcome == "better"


def test_the_same_errors_are_a_tie_won_half():
    errors = np.array([0.5, 1.0, 2.0])
    assert compare("self", errors, errors) == Comparison("self", 1.0, 0.5, 1.0, 3)
    assert compare("self", errors, errors).outcome == "tie"


def test_a_comparison_turned_round_turns_round():
    rng = np.random.default_rng(2)
    a, b = rng.lognormal(size=(2, 30))
    there, back = compare("b", a, 2 * b), compare("a", 2 * b, a)
    assert there.p == pytest.approx(back.p)
    assert there.ratio * back.ratio == pytest.approx(1.0)
    assert {there.outcome, back.outcome} in ({"better", "worse"}, {"tie"})


def test_what_p_does_not_tell_apart_is_a_tie_whatever_the_ratio():
    assert Comparison("x", 0.3, 0.9, 0.05, 5).outcome == "tie"
    assert Comparison("x", 0.3, 0.9, 0.049, 5).outcome == "better"
    assert Comparison("x", 1.3, 0.1, 0.049, 5).outcome == "worse"


def test_the_interval_of_the_median_covers_it_about_95_times_of_100():
    rng = np.random.default_rng(3)
    covered = []
    for seed in range(200):
        low, high = bootstrap_ci95(rng.lognormal(0.0, 1.0, 30), seed, statistic=np.median)
        covered.append(low <= 1.0 <= high)
    assert 0.90 <= np.mean(covered) <= 0.99
    assert bootstrap_ci95(np.full(9, 2.5), statistic=np.median) == (2.5, 2.5)
