"""The choice of cameras next to the best of all choices."""

from itertools import combinations

import numpy as np
import pytest

from pipeline.planning.choose import choose

ALL = slice(None)


def gain_of(chance, rows):
    """Expected number of targets that at least one of the rows measures."""
    return chance.shape[1] - np.prod(1.0 - chance[list(rows)], axis=0).sum()


def best_gain(chance, allowed, count):
    rows = np.flatnonzero(allowed)
    return max(gain_of(chance, some) for some in combinations(rows, min(count, len(rows))))


def instance(seed):
    rng = np.random.default_rng(seed)
    chance = rng.uniform(0, 1, (9, 12)) * (rng.uniform(0, 1, (9, 12)) < 0.4)
    return chance.astype(np.float32), rng.uniform(0, 1, 9) < 0.8


@pytest.mark.parametrize("seed", range(40))
@pytest.mark.parametrize("count", [1, 2, 3])
def test_against_every_choice(seed, count):
    chance, allowed = instance(seed)
    allowed[:3] = True
    choice, best = choose(chance, allowed, np.arange(9), count), best_gain(chance, allowed, count)
    assert choice.gain == pytest.approx(gain_of(chance, choice.rows))
    assert (1.0 - 1.0 / np.e) * best <= choice.gain <= best + 1e-6
    assert choice.best_at_most >= best - 1e-6
    if count == 1:
        assert choice.gain == pytest.approx(best)
        assert choice.best_at_most == pytest.approx(best)
    assert all(allowed[list(choice.rows)])
    assert len(set(choice.rows)) == len(choice.rows) == count


def test_an_exchange_repairs_the_greedy_choice():
    """The first row alone is the largest, but the other two together have everything."""
    chance = np.array([[1, 1, 1, 1, 0, 0], [1, 1, 0, 0, 1, 0.5], [0, 0, 1, 1, 0.5, 1]], float)
    assert gain_of(chance, [0, 1]) < gain_of(chance, [1, 2]) == 6.0
    choice = choose(chance, np.ones(3, bool), np.arange(3), 2)
    assert sorted(choice.rows) == [1, 2]
    assert choice.gain == pytest.approx(6.0)


def test_each_adds_less_than_the_one_before_and_all_together_the_gain():
    chance, _ = instance(7)
    choice = choose(chance, np.ones(9, bool), np.arange(9), 5)
    gains = choice.gains.sum(axis=1)
    assert np.all(np.diff(gains) <= 1e-9)
    for k in range(1, 6):
        assert gains[:k].sum() == pytest.approx(gain_of(chance, choice.rows[:k]), rel=1e-6)


def test_a_camera_that_adds_nothing_is_not_chosen():
    chance = np.array([[1, 1, 0], [1, 0, 0], [0, 0, 0]], float)
    assert choose(chance, np.ones(3, bool), np.arange(3), 3).rows == (0,)
    assert choose(chance, np.array([False, False, True]), np.arange(3), 2).rows == ()


def test_the_same_chances_give_the_same_choice():
    chance, allowed = instance(3)
    assert (
        choose(chance, allowed, np.arange(9), 3).rows
        == choose(chance.copy(), allowed.copy(), np.arange(9), 3).rows
    )


def test_at_a_place_stands_one_camera():
    """The two best rows are two aims of one place; the third row adds least, but from elsewhere."""
    chance = np.array([[1, 1, 1, 0, 0, 0], [0, 0, 0, 1, 1, 0], [0, 0, 0, 0, 0, 1]], float)
    allowed = np.ones(3, bool)
    assert choose(chance, allowed, np.array([0, 1, 2]), 2).rows == (0, 1)
    choice = choose(chance, allowed, np.array([0, 0, 1]), 2)
    assert choice.rows == (0, 2)
    assert choice.best_at_most >= choice.gain == 4.0
    assert choose(chance, allowed, np.zeros(3, int), 3).rows == (0,)
