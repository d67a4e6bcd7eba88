from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pipeline.config import RegistrationConfig
from pipeline.registration.ceicp import CeicpA, CeicpN, entropy_weights
from pipeline.registration.matching import Matching
from pipeline.types import PointCloud
from tests.pipeline.registration.pairs import pairs_at


@given(distances=st.lists(st.floats(0.0, 1.0), min_size=5, max_size=60), gate_m=st.floats(0.01, 2.0))
@settings(max_examples=100, deadline=None)
def test_weights_of_n_are_a_falling_distribution(distances, gate_m):
    kept = CeicpN(gate_m).weigh(pairs_at(distances))
    assert np.flatnonzero(np.asarray(distances) <= gate_m).tolist() == kept.rows.tolist()
    if not len(kept.rows):
        return
    assert (kept.weights >= 0).all()
    assert kept.weights.sum() == pytest.approx(1.0, abs=1e-12)
    assert 0 <= kept.entropy_nat <= np.log(len(kept.rows)) + 1e-12
    if len(kept.rows) >= 5:  # the guarantee of SPEC 4.4
        by_distance = kept.weights[np.argsort(np.asarray(distances)[kept.rows], kind="stable")]
        assert (np.diff(by_distance) <= 1e-12).all()


@given(seed=st.integers(0, 2**32 - 1), sigma_m=st.floats(0.005, 0.5))
@settings(max_examples=50, deadline=None)
def test_weights_of_a_fall_over_its_whole_gate(seed, sigma_m):
    """245 pairs are enough in the worst case (SPEC 4.4)."""
    distances_m = np.sort(np.random.default_rng(seed).uniform(0.0, 4.0 * sigma_m, 400))
    kept = CeicpA(sigma_m, sigma_m, sigma_m, 0.85).weigh(pairs_at(distances_m))
    assert (distances_m[kept.rows] <= 3.0 * sigma_m).all()
    assert (np.diff(kept.weights) < 0).all()
    assert (kept.weights > 0).all()


def test_weights_follow_the_formula():
    distances_m, sigma_m = np.array([0.0, 0.01, 0.02, 0.05]), 0.03
    g = np.exp(-(distances_m**2) / (2 * sigma_m**2))
    p = g / g.sum()
    w = -p * np.log(p)
    weights, _, entropy_nat = entropy_weights(distances_m, sigma_m)
    np.testing.assert_allclose(weights, w / w.sum(), atol=1e-15)
    assert entropy_nat == pytest.approx(w.sum())


def test_weights_do_not_know_the_unit():
    distances_m = np.random.default_rng(0).uniform(0.0, 0.1, 50)
    np.testing.assert_allclose(
        entropy_weights(distances_m, 0.03)[0], entropy_weights(1000.0 * distances_m, 30.0)[0], atol=1e-15
    )


def test_perfect_matches_weigh_the_same():
    kept = CeicpN(0.3).weigh(pairs_at(np.zeros(10)))
    np.testing.assert_allclose(kept.weights, 0.1)
    assert kept.entropy_nat == pytest.approx(np.log(10))


def test_the_scale_of_a_shrinks_to_its_floor_and_doubles_once():
    grid = np.stack(np.meshgrid(*3 * [np.arange(5.0)]), axis=-1).reshape(-1, 3) * 0.05
    method = CeicpA.starting(
        RegistrationConfig(gate_m=0.3, sigma_decay=0.5), PointCloud(grid), PointCloud(grid)
    )
    sigmas = [method.sigma_m]
    while not method.settled:
        method = method.following(kept=None, still=False)
        sigmas.append(method.sigma_m)
    np.testing.assert_allclose(sigmas, [0.2, 0.1, 0.05, 0.03])
    wider = method.widened()
    assert wider.sigma_m == pytest.approx(0.06)
    assert wider.widened() is None
    assert CeicpA(0.15, 0.2, 0.03, 0.5).widened().sigma_m == 0.2


def test_the_scale_of_n_is_the_root_mean_square_of_the_kept_distances():
    kept = CeicpN(0.1).weigh(pairs_at([0.01, 0.5, 0.07]))  # (1 + 49) / 2 = 5^2
    assert kept.sigma_m == pytest.approx(0.05, rel=1e-12)


def test_a_noisy_sensor_lifts_the_floor():
    grid = np.stack(np.meshgrid(*3 * [np.arange(5.0)]), axis=-1).reshape(-1, 3) * 0.01
    config = RegistrationConfig()
    assert CeicpA.starting(config, PointCloud(grid), PointCloud(grid)).sigma_min_m == pytest.approx(0.006)
    noisy = PointCloud(grid, sigma_m=np.full(len(grid), 0.02))
    assert CeicpA.starting(config, noisy, noisy).sigma_min_m == pytest.approx(0.02)


def facing(distances_m, cosines) -> Matching:
    """Pairs at given distances whose normals have given cosines."""
    cosines = np.asarray(cosines, dtype=float)
    return replace(
        pairs_at(distances_m), cosines=cosines, normals=np.tile([0.0, 0.0, 1.0], (len(cosines), 1))
    )


def test_weights_of_a_are_those_of_the_joint_probability_of_distance_and_normals():
    """P is exp(-d^2 / 2 sigma^2 - (1 - |n . n'|) / s^2) over its sum, s = 0.5, of pairs within 60 degrees."""
    distances_m, sigma_m = np.array([0.0, 0.01, 0.02, 0.05, 0.01]), 0.03
    cosines = np.array([1.0, 0.9, 0.6, 0.99, 0.49])
    kept = CeicpA(sigma_m, sigma_m, sigma_m, 0.85).weigh(facing(distances_m, cosines))
    assert kept.rows.tolist() == [0, 1, 2, 3]
    g = np.exp(-(distances_m[:4] ** 2) / (2 * sigma_m**2) - (1.0 - cosines[:4]) / 0.25)
    p = g / g.sum()
    w = -p * np.log(p)
    np.testing.assert_allclose(kept.weights, w / w.sum(), atol=1e-15)
    assert kept.entropy_nat == pytest.approx(w.sum())


def test_pairs_across_normals_do_not_count_however_near():
    """Of 20 pairs every second one stands across by 61 degrees, the others by 59."""
    cosines = np.cos(np.radians(np.tile([59.0, 61.0], 10)))
    kept = CeicpA(0.1, 0.1, 0.1, 0.85).weigh(facing(np.zeros(20), cosines))
    assert kept.rows.tolist() == list(range(0, 20, 2))
    np.testing.assert_allclose(kept.weights, 0.1)


def test_normals_that_agree_alike_leave_the_weights_of_the_distances():
    distances_m = np.random.default_rng(1).uniform(0.0, 0.1, 50)
    method = CeicpA(0.05, 0.05, 0.05, 0.85)
    with_normals = method.weigh(facing(distances_m, np.full(50, 0.8)))
    np.testing.assert_allclose(with_normals.weights, method.weigh(pairs_at(distances_m)).weights, atol=1e-14)


@pytest.mark.parametrize(
    ("direction", "shares"), [("q2p", (0.4, 1.0)), ("p2q", (1.0, 0.25)), ("both", (1.0, 1.0))]
)
def test_a_wide_kernel_matches_2000_points_of_the_cloud_that_looks_for_partners(direction, shares):
    rng = np.random.default_rng(0)
    source, target = (PointCloud(rng.uniform(0.0, 1.0, (count, 3))) for count in (5000, 8000))
    config = RegistrationConfig("ceicp-a", direction=direction)
    method = CeicpA.starting(config, source, target)
    assert (method.least_source_share, method.least_target_share) == shares
