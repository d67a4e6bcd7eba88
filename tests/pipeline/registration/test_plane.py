import numpy as np
import pytest

from pipeline.geometry import apply, rigid, rotation_exp
from pipeline.registration.residual import DegenerateError, solve_plane


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
    with pytest.raises(DegenerateError, match=r"^sliding across z and turning about z changes no distance"):
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
