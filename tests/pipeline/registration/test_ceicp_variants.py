"""CEICP-R, CEICP-ML and kernel correlation against what SPEC 4.4 says of them."""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pipeline.config import RegistrationConfig
from pipeline.kernels.geometry import inverse, rigid, rotation_exp
from pipeline.registration import iterate_registration, point_error_m, register
from pipeline.registration.ceicp import CeicpA, CeicpR, entropy_weights
from pipeline.registration.ceicp_ml import CeicpMl, box_volume_m3, responsibilities
from pipeline.registration.kernel_correlation import KernelCorrelation
from pipeline.types import PointCloud
from tests.pipeline.registration.pairs import pairs_at

AWAY = rigid(rotation_exp(np.array([0.4, 1.1, -0.7])), [3.0, -2.0, 5.0])


def test_the_scale_of_r_is_robust_and_only_shrinks():
    method = CeicpR(sigma_min_m=0.01)
    distances_m = np.append(np.linspace(0.0, 0.1, 11), [3.0, 4.0])  # median 0.06
    kept = method.weigh(pairs_at(distances_m))
    assert kept.sigma_m == pytest.approx(1.4826 * 0.06)
    assert kept.rows.tolist() == list(range(11))
    np.testing.assert_allclose(kept.weights, entropy_weights(distances_m[:11], kept.sigma_m)[0])
    method = method.following(kept, still=False)
    assert method.weigh(pairs_at(2.0 * distances_m)).sigma_m == kept.sigma_m
    assert method.weigh(pairs_at(0.5 * distances_m)).sigma_m == pytest.approx(0.5 * kept.sigma_m)
    assert method.weigh(pairs_at(0.01 * distances_m)).sigma_m == 0.01


def test_r_needs_no_gate(corner, motion):
    """A gate of a millimetre, which would leave CEICP-N nothing, does not matter."""
    source = corner.transformed(inverse(motion))
    config = RegistrationConfig("ceicp-r", "point", gate_m=1e-3, sigma_min_m=0.005)
    steps = register(source, corner, config).steps
    assert point_error_m(steps[-1].T_target_source, motion, corner.points_m) < 1e-6
    sigmas_m = np.array([step.sigma_m for step in steps])
    assert (np.diff(sigmas_m) <= 0.0).all()
    assert sigmas_m[0] > 0.02
    assert sigmas_m[-1] == 0.005


@given(
    seed=st.integers(0, 2**32 - 1),
    sigma_m=st.floats(1e-3, 1.0),
    outlier=st.floats(0.0, 10.0, exclude_min=True),
)
@settings(max_examples=50, deadline=None)
def test_responsibilities_leave_room_for_the_outlier(seed, sigma_m, outlier):
    squared_m2 = np.sort(np.random.default_rng(seed).uniform(0.0, 1.0, (40, 5)), axis=1)
    gamma = responsibilities(squared_m2, sigma_m**2, outlier)
    kernel = np.exp(-squared_m2 / (2.0 * sigma_m**2))
    assert (gamma >= 0.0).all()
    assert (gamma.sum(axis=1) <= 1.0 + 1e-14).all()
    np.testing.assert_allclose(1.0 - gamma.sum(axis=1), outlier / (kernel.sum(axis=1) + outlier), atol=1e-12)
    assert (np.diff(gamma, axis=1) <= 0.0).all()


def test_an_alien_point_has_no_say():
    """One target point far from everything: its pairs weigh nothing, those of the others share the sum."""
    distances_m = np.append(np.tile([0.01, 0.02, 0.03, 0.04, 0.05], 20), np.full(5, 2.0))
    kept = CeicpMl(0.01, outlier_density=50.0, count=5, sigma_m=0.02).weigh(pairs_at(distances_m))
    assert kept.rows.max() < 100
    assert kept.weights.sum() == pytest.approx(1.0, abs=1e-12)
    by_point = kept.weights.reshape(20, 5)
    np.testing.assert_allclose(by_point, np.tile(by_point[0], (20, 1)), rtol=1e-12)
    expected_m = np.sqrt(kept.weights @ distances_m[kept.rows] ** 2 / 3.0)
    assert kept.sigma_m == pytest.approx(expected_m)


def test_the_first_scale_of_ml_is_the_mean_square_over_three():
    distances_m = np.full(50, 0.3)
    kept = CeicpMl(0.01, outlier_density=1e-9, count=5).weigh(pairs_at(distances_m))
    assert kept.sigma_m == pytest.approx(0.3 / np.sqrt(3.0))
    np.testing.assert_allclose(kept.weights, 1.0 / 50.0)


def test_em_lowers_the_cross_entropy(halves):
    """Neither a new scale nor a new motion raises -sum log(sum_i N(p_j; x_i) + outlier)."""
    source, target, T = halves
    config = RegistrationConfig("ceicp-ml", "point")
    outlier_density = CeicpMl.starting(config, source, target).outlier_density
    T_before, entropies, sigma_m = np.eye(4), [], None
    for step in iterate_registration(source, target, config):
        if sigma_m is not None:
            entropies.append(_cross_entropy(source, target, T_before, sigma_m, outlier_density))
        T_before, sigma_m = step.T_target_source, step.sigma_m
    assert len(entropies) > 5
    assert (np.diff(entropies) <= 1e-6).all()
    assert point_error_m(T_before, T, source.points_m) < 0.006


def _cross_entropy(source, target, T, sigma_m, outlier_density):
    """H(P, Q_T) in nats a point, up to a constant."""
    gaps_m2 = np.sum((source.transformed(T).points_m[:, None] - target.points_m) ** 2, axis=2)
    density = np.exp(-0.5 * gaps_m2 / sigma_m**2).sum(axis=0) / (2.0 * np.pi * sigma_m**2) ** 1.5
    return -np.mean(np.log(density + outlier_density))


def test_the_box_turns_with_the_cloud():
    """The axes of a random sample lean a little, so that its box is a little too large."""
    rng = np.random.default_rng(0)
    points_m = rng.uniform(0.0, 1.0, (4000, 3)) * [1.0, 2.0, 4.0]
    volume_m3 = box_volume_m3(points_m, 0.1)
    assert volume_m3 == pytest.approx(8.0, rel=0.15)
    assert box_volume_m3(PointCloud(points_m).transformed(AWAY).points_m, 0.1) == pytest.approx(volume_m3)
    assert box_volume_m3(points_m * [1.0, 1.0, 0.0], 0.1) == pytest.approx(0.2, rel=0.15)


def test_an_outlier_of_ml_is_anywhere_in_the_targets_box():
    """w0 / (1 - w0) |Q| / V with w0 = 0.2: a quarter of 300 points in 8 cubic metres."""
    target = PointCloud(np.array(list(product((0.0, 1.0), (0.0, 2.0), (0.0, 4.0)))))
    source = PointCloud(np.random.default_rng(0).normal(size=(300, 3)))
    method = CeicpMl.starting(RegistrationConfig("ceicp-ml"), source, target)
    assert method.outlier_density == pytest.approx(0.25 * 300 / 8.0)


def test_ml_asks_five_or_all_of_a_small_source():
    config = RegistrationConfig("ceicp-ml", direction="q2p")
    cloud = PointCloud(np.random.default_rng(0).normal(size=(30, 3)))
    method = CeicpMl.starting(config, cloud.select(np.arange(4)), cloud)
    assert (method.neighbours, method.direction) == (4, "p2q")
    assert CeicpMl.starting(config, cloud, cloud).neighbours == 5


def test_kernel_correlation_is_a_gaussian_on_the_schedule_of_a(corner):
    config = RegistrationConfig("kernel-correlation", sigma_decay=0.5)
    method = KernelCorrelation.starting(config, corner, corner)
    reference = CeicpA.starting(config, corner, corner)
    while not method.settled:
        assert (method.sigma_m, method.gate_m) == (reference.sigma_m, reference.gate_m)
        distances_m = method.sigma_m * np.array([0.0, 1.0, 2.0, 3.5])
        kept = method.weigh(pairs_at(distances_m))
        expected = np.exp([0.0, -0.5, -2.0])
        np.testing.assert_allclose(kept.weights, expected / expected.sum(), rtol=1e-12)
        method, reference = method.following(kept, False), reference.following(kept, False)
    assert reference.settled
    assert method.neighbours == 10


def test_kernel_correlation_finds_ten_partners_each(corner):
    cloud = corner.select(np.arange(0, 1500, 5))
    step = next(
        iterate_registration(cloud, cloud, RegistrationConfig("kernel-correlation", "point", gate_m=3.0))
    )
    assert (np.bincount(step.pairs[:, 0]) == 10).all()


def test_kernel_correlation_measures_to_the_planes_of_the_target_alone(corner, motion):
    """As all methods do whose weights do not depend on the normals."""
    source, rng = corner.transformed(inverse(motion)), np.random.default_rng(0)
    config = RegistrationConfig("kernel-correlation", "plane", max_iterations=3)
    bare, given = (
        register(replace(source, normals=normals), corner, config)
        for normals in (None, rng.normal(size=(len(source), 3)))
    )
    assert given.T_target_source.tobytes() == bare.T_target_source.tobytes()
