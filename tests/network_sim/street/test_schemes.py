"""Coverage, GREEDY and PDC against their definitions (SPEC 6.2), worked out the long way."""

from itertools import combinations
from math import e

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from network_sim.config import SchemeConfig
from network_sim.street.schemes import make_scheme
from network_sim.street.schemes.greedy import Coverage, Greedy, select
from network_sim.street.schemes.pdc import FLOOR, Pdc, adapted, probabilities
from network_sim.types import to_ns

VALIDITY_S = 10
IMAGES = st.lists(st.tuples(st.integers(0, 2), st.integers(0, 40)), max_size=7)


def _utility(images: list[tuple[int, int]]) -> int:
    """F(A), second by second."""
    return len({(cell, taken + second) for cell, taken in images for second in range(VALIDITY_S)})


def _covered(images: list[tuple[int, int]]) -> Coverage:
    coverage = Coverage(VALIDITY_S)
    for cell, taken in images:
        coverage.add(cell, taken)
    return coverage


def _select(known: list[tuple[int, int]], offered: list[tuple[int, int]], k: int | None) -> list[int]:
    return select(_covered(known), [cell for cell, _ in offered], [taken for _, taken in offered], k)


@given(IMAGES, st.tuples(st.integers(0, 2), st.integers(0, 40)))
def test_gain_is_the_difference_of_utilities(images: list[tuple[int, int]], more: tuple[int, int]) -> None:
    assert _covered(images).gain_ns(*more) == _utility([*images, more]) - _utility(images)


@given(IMAGES, IMAGES, st.tuples(st.integers(0, 2), st.integers(0, 40)))
def test_utility_is_monotone_and_submodular(
    few: list[tuple[int, int]], others: list[tuple[int, int]], more: tuple[int, int]
) -> None:
    gain_of_few, gain_of_many = _covered(few).gain_ns(*more), _covered(few + others).gain_ns(*more)
    assert 0 <= gain_of_many <= gain_of_few


@given(IMAGES, IMAGES, st.tuples(st.integers(0, 2), st.integers(0, 40)))
def test_what_did_not_come_leaves_no_mark(
    images: list[tuple[int, int]], missed: list[tuple[int, int]], probe: tuple[int, int]
) -> None:
    coverage = _covered(images + missed)
    for cell, taken in missed:
        coverage.remove(cell, taken)
    assert coverage.gain_ns(*probe) == _covered(images).gain_ns(*probe)


@given(IMAGES, IMAGES, st.integers(1, 4))
def test_greedy_is_within_its_bound_of_the_best_request(
    known: list[tuple[int, int]], offered: list[tuple[int, int]], k: int
) -> None:
    chosen = _select(known, offered, k)
    before = _utility(known)
    gained = _utility(known + [offered[index] for index in chosen]) - before
    best = max(_utility([*known, *some]) for some in combinations(offered, len(chosen))) - before
    assert gained >= (1 - 1 / e) * best


@given(IMAGES, IMAGES, st.one_of(st.none(), st.integers(1, 4)))
def test_lazy_greedy_chooses_what_plain_greedy_does(
    known: list[tuple[int, int]], offered: list[tuple[int, int]], k: int | None
) -> None:
    held, plain = list(known), []
    while k is None or len(plain) < k:
        gains = [_utility([*held, image]) - _utility(held) for image in offered]
        if not gains or max(gains) < VALIDITY_S / 2:
            break
        plain.append(gains.index(max(gains)))
        held.append(offered[plain[-1]])
    assert _select(known, offered, k) == plain


def test_greedy_takes_two_of_the_five_images_of_a_cell() -> None:
    offered = [(0, 0), (0, 2), (0, 4), (0, 6), (0, 8)]
    assert _select([], offered, None) == [0, 4]
    assert _select([], offered, 1) == [0]
    assert _select([(0, -5)], offered, None) == [3], "6 s adds 10 s; then 0 s adds 1 s and 8 s adds 2 s"
    assert _select(offered, offered, None) == []


def test_greedy_asks_again_for_what_did_not_come() -> None:
    greedy = Greedy(VALIDITY_S, None)
    cells, taken = np.array([3]), np.array([100])
    assert greedy.chosen(cells, taken, 0) == [0]
    assert greedy.chosen(cells, taken, 0) == []
    greedy.missed(3, 100)
    assert greedy.chosen(cells, taken, 0) == [0]


def test_baseline_wants_all() -> None:
    baseline = make_scheme(SchemeConfig(), 4, np.random.default_rng(0))
    assert not baseline.on_request
    assert baseline.chosen(np.array([2, 2, 2]), np.array([1, 2, 3]), 9) == [0, 1, 2]


def test_pdc_falls_from_one_to_a_single_cover() -> None:
    rates = np.array([0.0, 3.0, 5.5, 8.0, 12.0, 60.0, 1000.0])
    expected = [1.0, 1.0, (1 + 0.75) / 2, 0.75, 0.5, 0.1, FLOOR]
    assert probabilities(rates, SchemeConfig()) == pytest.approx(expected)


@given(st.floats(0.0, 500.0), st.floats(0.0, 500.0))
def test_pdc_asks_less_where_more_is_seen(a: float, b: float) -> None:
    less, more = probabilities(np.array(sorted([a, b])), SchemeConfig())
    assert FLOOR <= more <= less <= 1.0


def test_pdc_never_asks_with_more_than_certainty() -> None:
    config = SchemeConfig(r_low=1.0, r_high=2.0)
    assert probabilities(np.array([1.5, 2.0, 4.0, 12.0]), config) == pytest.approx([1.0, 1.0, 1.0, 0.5])


def test_pdc_counts_offers_over_the_observation_period() -> None:
    pdc = Pdc(SchemeConfig(name="pdc"), 2, np.random.default_rng(0))
    minute_ns = to_ns(60.0)
    seen = np.zeros(12, dtype=np.int64)
    for minute in range(12):
        assert pdc.probabilities[0] == (1.0 if minute < 2 else 0.5), "set at the first offer of a new period"
        pdc.chosen(seen, seen, minute * minute_ns)
    assert pdc.probabilities.tolist() == [0.5, 1.0], "12 a minute, and a cell never seen"
    pdc.chosen(seen[:0], seen[:0], 17 * minute_ns)
    assert pdc.probabilities[0] == pytest.approx(probabilities(np.array([12 * 5 / 10]), SchemeConfig())[0])
    pdc.chosen(seen[:0], seen[:0], 40 * minute_ns)
    assert pdc.probabilities[0] == 1.0, "forgotten"


def test_pdc_asks_with_its_probability() -> None:
    pdc = Pdc(SchemeConfig(name="pdc"), 3, np.random.default_rng(0))
    pdc.probabilities[:] = [0.25, 1.0, 0.0]
    cells = np.repeat(np.arange(3), 4000)
    asked = np.bincount(cells[pdc.chosen(cells, cells, 0)], minlength=3)
    assert asked[0] == pytest.approx(1000, abs=100)
    assert asked[1:].tolist() == [4000, 0]


def test_pdc_received_turns_down_fast_and_up_slowly() -> None:
    previous = np.array([0.5, 0.5, 0.5, 0.025, 0.95])
    rates = np.array([9.0, 5.0, 2.0, 9.0, 0.0])
    assert adapted(previous, rates, SchemeConfig()) == pytest.approx([0.35, 0.5, 0.6, FLOOR, 1.0])


def test_pdc_received_counts_what_came() -> None:
    pdc = Pdc(SchemeConfig(name="pdc-received"), 2, np.random.default_rng(0))
    offered = np.zeros(50, dtype=np.int64)
    pdc.chosen(offered, offered, 0)
    for _ in range(9):
        pdc.received(1, 0)
    pdc.chosen(offered, offered, to_ns(60.0))
    assert pdc.probabilities == pytest.approx([1.0, 0.7])
