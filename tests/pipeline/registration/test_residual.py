"""Both residuals of a pair: the motions that make them least, and when there is none."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pipeline.kernels.geometry import apply, rigid, rotation_exp
from pipeline.registration.matching import Matching
from pipeline.registration.neighbourhood import Normals
from pipeline.registration.residual import DegenerateError, PlaneResidual, solve_plane, weighted_procrustes

seeds = st.integers(0, 2**32 - 1)


@given(seed=seeds, angle_rad=st.floats(0.0, np.pi), scale=st.floats(0.2, 5.0))
@settings(max_examples=50, deadline=None)
def test_recovers_a_random_similarity_exactly(seed, angle_rad, scale):
    rng = np.random.default_rng(seed)
    axis = rng.normal(size=3)
    rotation = rotation_exp(angle_rad * axis / np.linalg.norm(axis))
    T = rigid(scale * rotation, rng.normal(size=3))
    q = rng.normal(size=(30, 3))
    weights = rng.uniform(0.1, 1.0, 30)
    np.testing.assert_allclose(weighted_procrustes(q, apply(T, q), weights, True), T, atol=1e-9)
    rigid_T = rigid(rotation, T[:3, 3])
    np.testing.assert_allclose(weighted_procrustes(q, apply(rigid_T, q), weights), rigid_T, atol=1e-9)


@given(seed=seeds)
@settings(max_examples=25, deadline=None)
def test_no_other_motion_has_a_smaller_cost(seed):
    """The closed form is the minimum: every small motion away from it costs more."""
    rng = np.random.default_rng(seed)
    q, p = rng.normal(size=(2, 20, 3))
    weights = rng.uniform(size=20)

    def cost(T):
        return weights @ np.sum((apply(T, q) - p) ** 2, axis=1)

    best = weighted_procrustes(q, p, weights)
    for omega, shift in rng.normal(scale=1e-3, size=(10, 2, 3)):
        assert cost(best) <= cost(rigid(rotation_exp(omega), shift) @ best)
    assert cost(weighted_procrustes(q, p, weights, with_scale=True)) <= cost(best)


def test_mirrored_points_still_give_a_rotation():
    q = np.random.default_rng(0).normal(size=(50, 3))
    T = weighted_procrustes(q, q * [1.0, 1.0, -1.0], np.ones(50))
    assert np.linalg.det(T[:3, :3]) == pytest.approx(1.0, abs=1e-12)


def test_points_of_a_plane_are_enough():
    q = np.random.default_rng(0).normal(size=(50, 3)) * [1.0, 1.0, 0.0]
    T = rigid(rotation_exp(np.array([0.3, -0.2, 0.5])), [1.0, 2.0, 3.0])
    np.testing.assert_allclose(weighted_procrustes(q, apply(T, q), np.ones(50)), T, atol=1e-12)


def test_zero_weight_means_absent():
    rng = np.random.default_rng(1)
    q, p = rng.normal(size=(2, 20, 3))
    weights = np.r_[np.ones(10), np.zeros(10)]
    np.testing.assert_allclose(
        weighted_procrustes(q, p, weights), weighted_procrustes(q[:10], p[:10], np.ones(10)), atol=1e-12
    )


def test_a_line_of_points_is_refused():
    q = np.linspace(0.0, 1.0, 20)[:, None] * np.array([1.0, 2.0, 3.0])
    with pytest.raises(DegenerateError, match="one line"):
        weighted_procrustes(q, q, np.ones(20))


def _patches(rng, count=300):
    """Points with random normals: every motion is seen."""
    normals = rng.normal(size=(count, 3))
    return rng.normal(size=(count, 3)), normals / np.linalg.norm(normals, axis=1, keepdims=True)


def test_newton_steps_reach_the_true_motion():
    rng = np.random.default_rng(0)
    target, normals = _patches(rng)
    T_true = rigid(rotation_exp(np.array([0.1, -0.05, 0.08])), [0.1, 0.2, -0.1])
    source = apply(np.linalg.inv(T_true), target)
    T = np.eye(4)
    for _ in range(6):
        T = solve_plane(apply(T, source), target, normals, np.ones(len(source))) @ T
    np.testing.assert_allclose(T, T_true, atol=1e-9)
    assert np.linalg.det(T[:3, :3]) == pytest.approx(1.0, abs=1e-12)


def test_the_step_neither_knows_the_origin_nor_the_unit():
    rng = np.random.default_rng(1)
    target, normals = _patches(rng)
    source = target + 0.01 * rng.normal(size=target.shape)
    weights = rng.uniform(size=len(source))
    step = solve_plane(source, target, normals, weights)
    shift = np.array([100.0, -50.0, 20.0])
    moved = solve_plane(source + shift, target + shift, normals, weights)
    np.testing.assert_allclose(moved[:3, :3], step[:3, :3], atol=1e-9)
    np.testing.assert_allclose(apply(moved, source + shift) - shift, apply(step, source), atol=1e-9)
    scaled = solve_plane(1000.0 * source, 1000.0 * target, normals, weights)
    np.testing.assert_allclose(scaled[:3, :3], step[:3, :3], atol=1e-12)
    np.testing.assert_allclose(scaled[:3, 3], 1000.0 * step[:3, 3], atol=1e-9)


def test_the_free_motions_are_named():
    rng = np.random.default_rng(4)
    points = rng.uniform(-1.0, 1.0, (400, 3)) * [1.0, 1.0, 0.0]
    wall, floor = np.tile([1.0, 0.0, 0.0], (400, 1)), np.tile([0.0, 0.0, 1.0], (400, 1))
    with pytest.raises(
        DegenerateError,
        match=r"^sliding in any direction perpendicular to z and turning about z changes no distance",
    ):
        solve_plane(points, points, floor, np.ones(400))
    edge = np.concatenate([points, points[:, [2, 1, 0]]])
    with pytest.raises(DegenerateError, match=r"^sliding along y changes"):
        solve_plane(edge, edge, np.concatenate([floor, wall]), np.ones(800))


@pytest.mark.parametrize("surface", ["plane", "sphere", "point"])
def test_surfaces_that_let_the_source_slide_are_refused(surface):
    normals = np.random.default_rng(2).normal(size=(200, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    points = normals.copy()
    if surface == "plane":
        points, normals = points * [1.0, 1.0, 0.0], np.tile([0.0, 0.0, 1.0], (200, 1))
    if surface == "point":
        points = np.zeros_like(points)
    with pytest.raises(DegenerateError):
        solve_plane(points, points, normals, np.ones(200))


@pytest.mark.parametrize("height_m", [0.1, -0.3])
def test_the_plane_of_a_pair_is_across_its_own_normal(height_m):
    """Target points with wrong normals and pairs with right ones: the source is lifted along the latter."""
    rng = np.random.default_rng(8)
    points_m, normals = _patches(rng)
    shift_m = np.array([0.02, -0.03, height_m / 10])
    rows = np.arange(len(points_m))
    pairs = Matching(rows, rows, points_m, points_m + shift_m, np.full(len(rows), 1.0), normals)
    residual = PlaneResidual(Normals(points_m, np.roll(normals, 1, axis=0)))
    weights = np.full(len(rows), 1.0 / len(rows))
    motion = residual.solve(pairs, weights)
    np.testing.assert_allclose(motion, rigid(np.eye(3), shift_m), atol=1e-6)
    heights_m = normals @ shift_m
    assert residual.mean_squared_m2(pairs, weights, np.eye(4)) == pytest.approx(np.mean(heights_m**2))
    assert residual.mean_squared_m2(pairs, weights, motion) < 1e-10
