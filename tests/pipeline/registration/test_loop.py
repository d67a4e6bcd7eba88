"""What every method, metric and direction owes its user (SPEC 4.8, acceptance)."""

import itertools
from dataclasses import replace

import numpy as np
import pytest

from pipeline.config import RegistrationConfig
from pipeline.kernels.geometry import apply, inverse, rigid, rotation_exp
from pipeline.registration import iterate_registration, point_error_m, register
from pipeline.types import PointCloud

METHODS = ("icp", "ceicp-n", "ceicp-a")
METRICS = ("point", "plane")
DIRECTIONS = ("q2p", "p2q", "both")
EVERY = [
    pytest.param(RegistrationConfig(*choice), id="-".join(choice))
    for choice in itertools.product(METHODS, METRICS, DIRECTIONS)
]


@pytest.mark.parametrize("config", EVERY)
def test_identity_stays_identity(corner, config):
    result = register(corner, corner, config)
    np.testing.assert_allclose(result.T_target_source, np.eye(4), atol=1e-9)
    assert result.converged


def test_identity_stays_identity_when_thinned(corner):
    result = register(corner, corner, RegistrationConfig(max_points=500))
    np.testing.assert_allclose(result.T_target_source, np.eye(4), atol=1e-9)


@pytest.mark.parametrize("config", EVERY)
def test_a_clean_cloud_is_registered_exactly(corner, motion, config):
    """Every point has its partner, so the only fixed point near the start is the truth."""
    config = replace(config, sigma_min_m=0.005)
    result = register(corner.transformed(inverse(motion)), corner, config)
    assert result.converged
    assert point_error_m(result.T_target_source, motion, corner.points_m) < 1e-6
    assert np.linalg.det(result.T_target_source[:3, :3]) == pytest.approx(1.0, abs=1e-12)


@pytest.mark.parametrize("direction", DIRECTIONS)
@pytest.mark.parametrize("method", METHODS)
def test_a_scale_is_recovered(corner, motion, method, direction):
    T = motion @ np.diag([1.03, 1.03, 1.03, 1.0])
    config = RegistrationConfig(method, "point", direction, with_scale=True, sigma_min_m=0.005)
    result = register(corner.transformed(np.linalg.inv(T)), corner, config)
    np.testing.assert_allclose(result.T_target_source, T, atol=1e-6)


@pytest.mark.parametrize("config", EVERY)
def test_the_unit_of_length_does_not_matter(halves, config):
    source, target, _ = halves
    result = register(source, target, config)
    in_mm = register(
        PointCloud(1000.0 * source.points_m),
        PointCloud(1000.0 * target.points_m),
        replace(config, gate_m=1000.0 * config.gate_m),
    )
    np.testing.assert_allclose(in_mm.T_target_source[:3, :3], result.T_target_source[:3, :3], atol=1e-9)
    np.testing.assert_allclose(in_mm.T_target_source[:3, 3], 1000 * result.T_target_source[:3, 3], atol=1e-5)


@pytest.mark.parametrize("direction", ["q2p", "p2q"])
def test_the_error_of_icp_never_rises(halves, direction):
    """Besl and McKay: neither the update at fixed pairs nor the new matching can raise it."""
    source, target, _ = halves
    steps = register(source, target, RegistrationConfig("icp", "point", direction)).steps
    assert len(steps) > 5
    course = [value for step in steps for value in (step.rmse_m**2, step.objective)]
    assert (np.diff(course) <= 1e-15).all()


@pytest.mark.parametrize("config", EVERY)
def test_an_update_never_raises_its_objective(halves, config):
    """At fixed pairs and weights the motion lowers what it minimises; the plane metric is only linearised."""
    source, target, T = halves
    offset = rigid(rotation_exp(np.array([0.0, 0.02, 0.0])), [0.03, 0.0, 0.0])
    normals = np.random.default_rng(1).normal(size=target.points_m.shape)
    target = replace(target, normals=normals / np.linalg.norm(normals, axis=1, keepdims=True))
    for step, T_before in _with_pose_before(source, target, config, offset @ T):
        gaps_m = apply(T_before, source.points_m[step.pairs[:, 0]]) - target.points_m[step.pairs[:, 1]]
        if config.metric == "plane":
            gaps_m = np.sum(gaps_m * target.normals[step.pairs[:, 1]], axis=1, keepdims=True)
        before = step.weights @ np.sum(gaps_m**2, axis=1)
        assert step.objective <= before * (1.0 + 1e-6)


@pytest.mark.parametrize("config", EVERY)
def test_steps_say_what_was_done(halves, config):
    """Weights, pairs and distances of every step agree with the clouds as they were given."""
    source, target, _ = halves
    config = replace(config, max_points=400)
    for step, T_before in _with_pose_before(source, target, config, np.eye(4)):
        moved_m = apply(T_before, source.points_m[step.pairs[:, 0]])
        distances_m = np.linalg.norm(moved_m - target.points_m[step.pairs[:, 1]], axis=1)
        np.testing.assert_allclose(step.distances_m, distances_m, atol=1e-12)
        assert step.weights.shape == step.distances_m.shape
        assert (step.weights >= 0).all()
        assert step.weights.sum() == pytest.approx(1.0, abs=1e-12)
        assert 1.0 <= step.effective_pairs <= len(step.weights) + 1e-9
        assert step.rmse_m == pytest.approx(np.sqrt(step.weights @ distances_m**2))


def test_directions_pair_as_they_say(halves):
    source, target, _ = halves
    pairs = {direction: set(_first_pairs(source, target, direction)) for direction in DIRECTIONS}
    assert {i for i, _ in pairs["q2p"]} == set(range(len(source)))
    assert {j for _, j in pairs["p2q"]} == set(range(len(target)))
    assert pairs["both"] == pairs["q2p"] | pairs["p2q"]
    gaps_m = np.linalg.norm(source.points_m[:, None] - target.points_m[None], axis=2)
    assert pairs["q2p"] == set(enumerate(gaps_m.argmin(axis=1)))
    assert pairs["p2q"] == {(i, j) for j, i in enumerate(gaps_m.argmin(axis=0))}


def test_same_seed_same_bits(halves):
    source, target, _ = halves
    config = RegistrationConfig(max_points=300)
    first, second = (register(source, target, config) for _ in range(2))
    assert first.T_target_source.tobytes() == second.T_target_source.tobytes()
    other = register(source, target, replace(config, seed=1))
    assert other.T_target_source.tobytes() != first.T_target_source.tobytes()


def test_stepping_and_folding_agree(halves):
    source, target, _ = halves
    result = register(source, target, RegistrationConfig())
    steps = list(iterate_registration(source, target, RegistrationConfig()))
    assert [step.index for step in steps] == list(range(len(steps)))
    assert steps[-1].T_target_source.tobytes() == result.T_target_source.tobytes()
    assert result.stop_reason == "converged"


def test_it_stops_after_max_iterations(halves):
    source, target, _ = halves
    result = register(source, target, RegistrationConfig(max_iterations=3))
    assert (len(result.steps), result.stop_reason, result.converged) == (3, "max_iterations", False)


def _first_pairs(source, target, direction):
    step = next(iterate_registration(source, target, RegistrationConfig("icp", "point", direction)))
    return [tuple(pair) for pair in step.pairs]


def _with_pose_before(source, target, config, T):
    """Every step with the pose it started from."""
    for step in iterate_registration(source, target, config, T):
        yield step, T
        T = step.T_target_source
