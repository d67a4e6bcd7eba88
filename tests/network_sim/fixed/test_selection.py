"""Camera selection against the exhaustive optimum, plain greedy and chance."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from network_sim.fixed import selection as s
from packetmesh.errors import InputError

SHARE = 1.0 - 1.0 / math.e


def qualities(seed: int, cameras: int, voxels: int) -> tuple[s.FloatArray, s.FloatArray]:
    """(N, V) qualities of which many are zero, and (V,) weights."""
    rng = np.random.default_rng(seed)
    seen = rng.random((cameras, voxels)) < 0.35
    return np.where(seen, rng.random((cameras, voxels)), 0.0), rng.uniform(0.2, 2.0, voxels)


def cameras_around_a_wall(seed: int, cameras: int = 24, voxels: int = 150) -> s.FloatArray:
    """(N, V) qualities of cameras in front of a wavy wall that look at random along it, 60 degrees wide."""
    rng = np.random.default_rng(seed)
    along = np.linspace(0.0, 30.0, voxels)
    slope = 0.6 * np.cos(0.9 * along)
    normals = np.stack([-slope, np.ones(voxels)], axis=1) / np.hypot(slope, 1.0)[:, None]
    wall = np.stack([along, np.sin(0.9 * along)], axis=1)
    places = np.stack([rng.uniform(0.0, 30.0, cameras), rng.uniform(2.0, 8.0, cameras)], axis=1)
    angles = rng.uniform(-0.8, 0.8, cameras)
    axes = np.stack([np.sin(angles), -np.cos(angles)], axis=1)
    rays = wall[None] - places[:, None]
    distance_m = np.linalg.norm(rays, axis=2)
    rays /= distance_m[..., None]
    visible = np.einsum("nvd,nd->nv", rays, axes) > math.cos(math.radians(30.0))
    return s.view_quality(visible, distance_m, -np.einsum("nvd,vd->nv", rays, normals), reference_m=4.0)


def plain_greedy(q: s.FloatArray, count: int, weights: s.FloatArray) -> tuple[int, ...]:
    """Every gain anew in every round; the first of equal ones."""
    chosen: list[int] = []
    remaining = weights.copy()
    for _ in range(count):
        gains = [0.0 if i in chosen else float(row @ remaining) for i, row in enumerate(q)]
        best = int(np.argmax(gains))
        if gains[best] == 0.0:
            break
        chosen.append(best)
        remaining *= 1.0 - q[best]
    return tuple(chosen)


def optimum(q: s.FloatArray, count: int, weights: s.FloatArray) -> float:
    return max(s.coverage(q, chosen, weights) for chosen in itertools.combinations(range(len(q)), count))


def test_coverage_of_known_sets() -> None:
    q = np.array([[0.5, 0.0, 1.0], [0.5, 0.25, 0.0]])
    weights = np.array([1.0, 4.0, 10.0])
    assert s.coverage(q, []) == 0.0
    assert s.coverage(q, [0]) == pytest.approx(1.5)
    assert s.coverage(q, [0, 1]) == pytest.approx(0.75 + 0.25 + 1.0)
    assert s.coverage(q, [1, 0], weights) == pytest.approx(0.75 + 1.0 + 10.0)


@given(st.integers(0, 10_000))
def test_coverage_is_monotone_and_submodular(seed: int) -> None:
    q, weights = qualities(seed, 8, 20)
    order = np.random.default_rng(seed).permutation(8).tolist()
    small, large, camera = order[:2], order[:5], order[7]
    gain_small = s.coverage(q, [*small, camera], weights) - s.coverage(q, small, weights)
    gain_large = s.coverage(q, [*large, camera], weights) - s.coverage(q, large, weights)
    assert gain_small + 1e-12 >= gain_large >= -1e-12


@pytest.mark.parametrize("seed", range(40))
def test_greedy_has_its_share_of_the_optimum(seed: int) -> None:
    q, weights = qualities(seed, 9, 14)
    for count in (1, 2, 3, 4):
        best = optimum(q, count, weights)
        value = s.greedy(q, count, weights).value
        assert SHARE * best <= value <= best + 1e-12
        assert count > 1 or value == pytest.approx(best)


@pytest.mark.parametrize("seed", range(40))
def test_lazy_greedy_is_plain_greedy_with_fewer_gains(seed: int) -> None:
    q, weights = qualities(seed, 40, 60)
    lazy = s.greedy(q, 15, weights)
    assert lazy.cameras == plain_greedy(q, 15, weights)
    assert lazy.values == pytest.approx([s.coverage(q, lazy.cameras[: i + 1], weights) for i in range(15)])
    assert lazy.evaluations < 0.6 * sum(range(26, 41))


def test_of_equal_cameras_the_first_is_chosen() -> None:
    q = np.tile(np.eye(3), (3, 1))
    assert s.greedy(q, 9).cameras == plain_greedy(q, 9, np.ones(3)) == (0, 1, 2)


def test_a_camera_that_adds_nothing_stays_silent() -> None:
    q = np.array([[1.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.5]])
    chosen = s.greedy(q, 4)
    assert chosen.cameras == (0, 3)
    assert chosen.value == s.all_cameras(q).value == 2.5


@pytest.mark.parametrize("count", [3, 6, 12])
def test_greedy_beats_random_and_nearest_at_equal_count(count: int) -> None:
    """C36: mean F over 20 seeds."""
    greedy, chance, near = np.empty(20), np.empty(20), np.empty(20)
    for seed in range(20):
        q = cameras_around_a_wall(seed)
        rng = np.random.default_rng(1000 + seed)
        every = s.all_cameras(q).value
        greedy[seed] = s.greedy(q, count).value / every
        chance[seed] = s.at_random(q, count, rng).value / every
        near[seed] = s.nearest(q, count, rng.uniform(5.0, 50.0, len(q))).value / every
    assert np.all(greedy > chance)
    assert greedy.mean() > 1.15 * max(chance.mean(), near.mean())
    assert greedy.max() <= 1.0


def test_the_other_rules_choose_what_they_say() -> None:
    q, weights = qualities(1, 6, 9)
    assert s.nearest(q, 3, np.array([5.0, 1.0, 4.0, 1.0, 9.0, 2.0]), weights).cameras == (1, 3, 5)
    assert s.all_cameras(q, weights).cameras == tuple(range(6))
    drawn = [s.at_random(q, 4, np.random.default_rng(seed), weights) for seed in range(200)]
    assert all(len(set(one.cameras)) == 4 for one in drawn)
    assert drawn[7] == s.at_random(q, 4, np.random.default_rng(7), weights)
    uses = np.bincount([camera for one in drawn for camera in one.cameras], minlength=6)
    assert uses.min() > 100
    assert all(one.value == pytest.approx(s.coverage(q, one.cameras, weights)) for one in drawn)


@pytest.mark.parametrize("seed", range(30))
def test_choice_by_bytes_keeps_the_budget_and_its_share_of_the_optimum(seed: int) -> None:
    q, weights = qualities(seed, 9, 14)
    rng = np.random.default_rng(seed)
    costs = rng.uniform(10e3, 900e3, 9)
    budget = float(rng.uniform(costs.min(), 0.7 * costs.sum()))
    chosen = s.greedy_by_cost(q, costs, budget, weights)
    within = [
        subset
        for size in range(1, 10)
        for subset in itertools.combinations(range(9), size)
        if costs[list(subset)].sum() <= budget
    ]
    best = max(s.coverage(q, subset, weights) for subset in within)
    assert costs[list(chosen.cameras)].sum() <= budget
    assert 0.5 * SHARE * best <= chosen.value <= best + 1e-9
    assert chosen.value == pytest.approx(s.coverage(q, chosen.cameras, weights))


def test_choice_by_bytes_prefers_small_images_but_not_blindly() -> None:
    q = np.array([[1.0, 1.0, 1.0, 0.0], [1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 1.0]])
    assert s.greedy_by_cost(q, np.array([900.0, 50.0, 100.0]), 200.0).cameras == (1, 2)
    tiny_but_useless = np.array([[0.02, 0.0], [1.0, 1.0]])
    assert s.greedy_by_cost(tiny_but_useless, np.array([1.0, 200.0]), 200.0).cameras == (1,)


def test_by_bytes_sees_more_for_the_same_bytes_than_by_gain() -> None:
    gained = []
    for seed in range(20):
        q = cameras_around_a_wall(seed)
        costs = np.random.default_rng(seed).uniform(20e3, 900e3, len(q))
        by_bytes = s.greedy_by_cost(q, costs, 1.5e6)
        order = s.greedy(q, len(q)).cameras
        affordable = np.cumsum(costs[list(order)]) <= 1.5e6
        gained.append(by_bytes.value - s.coverage(q, order[: int(affordable.sum())]))
    assert min(gained) >= -1e-9
    assert np.mean(gained) > 0.0


def test_view_quality_multiplies_visibility_resolution_and_incidence() -> None:
    visible = np.array([[True, True, True, False]])
    distance_m = np.array([[1.0, 4.0, 4.0, 1.0]])
    cosine = np.array([[0.5, 1.0, -0.3, 1.0]])
    assert s.view_quality(visible, distance_m, cosine, 2.0).tolist() == [[0.5, 0.25, 0.0, 0.0]]


@pytest.mark.parametrize(
    ("q", "count", "weights", "says"),
    [
        (np.ones(3), 1, None, "shape"),
        (np.full((2, 2), 1.5), 1, None, "shares from 0 to 1"),
        (np.full((2, 2), np.nan), 1, None, "shares from 0 to 1"),
        (np.ones((2, 3)), 3, None, "try 1 to 2"),
        (np.ones((2, 3)), 0, None, "try 1 to 2"),
        (np.ones((2, 3)), 1, np.ones(2), "3 voxels"),
        (np.ones((2, 3)), 1, -np.ones(3), "none negative"),
    ],
)
def test_input_that_cannot_be_used_is_refused(
    q: s.FloatArray, count: int, weights: s.FloatArray | None, says: str
) -> None:
    with pytest.raises(InputError, match=says):
        s.greedy(q, count, weights)


def test_costs_and_budgets_that_cannot_be_used_are_refused() -> None:
    with pytest.raises(InputError, match="costs above 0"):
        s.greedy_by_cost(np.ones((2, 3)), np.array([1.0, 0.0]), 5.0)
    with pytest.raises(InputError, match="try at least 7"):
        s.greedy_by_cost(np.ones((2, 3)), np.array([7.0, 9.0]), 5.0)
