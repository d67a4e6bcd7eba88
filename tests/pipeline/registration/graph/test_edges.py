"""The information of an edge: what its pairs hold is stiff, what they leave open is soft."""

import numpy as np
import pytest

from pipeline.config import RegistrationConfig
from pipeline.kernels.geometry import apply, inverse, rigid, rotation_exp
from pipeline.registration import register
from pipeline.registration.graph.edges import (
    FLOOR_M,
    OPEN_M,
    PoseEdge,
    adjoint,
    registration_information,
    small_motion,
)
from pipeline.registration.graph.pose_graph import solve_pose_graph
from pipeline.registration.neighbourhood import pca_normals
from pipeline.types import PointCloud


def corridor(rng, ends: bool) -> np.ndarray:
    """Points on the floor, the ceiling and both walls of a corridor along x, 6 m by 2 m by 2.4 m."""
    u, v = rng.uniform(-3.0, 3.0, 6000), rng.uniform(0.0, 1.0, 6000)
    side = rng.integers(0, 4, 6000)
    y = np.where(side < 2, 2.0 * side - 1.0, 2.0 * v - 1.0)
    z = np.where(side < 2, 2.4 * v, 2.4 * (side - 2.0))
    points = np.stack([u, y, z], axis=1)
    if ends:
        points[:1500, 0] = 3.0
        points[:1500, 1:] = rng.uniform(0.0, 1.0, (1500, 2)) * [2.0, 2.4] - [1.0, 0.0]
    return points + 0.003 * rng.standard_normal(points.shape)


def edge_of(seed, ends, T_true, source=1, target=0):
    """An edge between two draws of a corridor, the second seen from another pose."""
    rng = np.random.default_rng(seed)
    there, here = corridor(rng, ends), apply(inverse(T_true), corridor(rng, ends))
    result = register(PointCloud(here), PointCloud(there), RegistrationConfig(), T_true)
    information = registration_information(result, here, pca_normals(here), pca_normals(there))
    return PoseEdge(source, target, result.T_target_source, information)


T_TRUE = rigid(rotation_exp(np.array([0.0, 0.0, 0.5])), np.array([0.4, 0.1, -0.1]))


def sd_m(edge, direction):
    """Standard error of the shift of the source's camera in a direction of the target's frame."""
    change = adjoint(edge.T_target_source)
    covariance = (change @ np.linalg.inv(edge.information) @ change.T)[3:, 3:]
    return float(np.sqrt(direction @ covariance @ direction))


def test_a_corridor_is_weak_along_itself_and_a_room_is_not():
    along, across = np.eye(3)[0], np.eye(3)[1]
    open_edge, closed = edge_of(1, False, T_TRUE), edge_of(2, True, T_TRUE)
    assert sd_m(open_edge, along) == pytest.approx(OPEN_M, rel=0.05)
    assert FLOOR_M <= sd_m(open_edge, across) < 0.01 * OPEN_M
    assert sd_m(closed, along) < 2.0 * FLOOR_M


def test_a_corridor_edge_slides_and_the_others_do_not():
    """Three nodes: two edges hold everything; the corridor's is 20 cm off along itself, 3 mm across."""
    T_10, T_21 = T_TRUE, rigid(np.eye(3), np.array([0.3, 0.0, 0.0]))
    firm = [edge_of(3, True, T_10, 1, 0), edge_of(4, True, T_21, 2, 1)]
    slid = rigid(np.eye(3), np.array([0.2, 0.0, 0.0])) @ T_10 @ T_21
    loose = edge_of(5, False, T_10 @ T_21, 2, 0)
    loose = PoseEdge(2, 0, slid, loose.information, 50.0)
    graph = solve_pose_graph([np.random.default_rng(0).uniform(-2, 2, (100, 3))] * 3, [*firm, loose])
    assert all(graph.used)
    np.testing.assert_allclose(graph.T_reference_node[1], T_10, atol=0.006)
    np.testing.assert_allclose(graph.T_reference_node[2], T_10 @ T_21, atol=0.01)
    assert graph.loop_error_m[2] == pytest.approx(0.2, abs=0.02)


def test_the_information_is_that_of_least_squares():
    """Three walls with known normals and equal weights: the formula on paper for the shift."""
    rng = np.random.default_rng(7)
    rows = np.repeat(np.arange(3), 400)
    points = rng.uniform(-1.0, 1.0, (1200, 3))
    points -= points.mean(axis=0)
    normals = np.eye(3)[rows]
    target = points + 0.05 * rng.standard_normal(1200)[:, None] * normals
    result = register(
        PointCloud(points), PointCloud(target, normals=normals), RegistrationConfig("icp", max_iterations=1)
    )
    last = result.steps[-1]
    edge = PoseEdge(1, 0, result.T_target_source, registration_information(result, points, normals, normals))
    share = np.bincount(rows[last.pairs[:, 1]], last.weights) / last.weights.sum()
    for axis in range(3):
        least = last.objective / (last.effective_pairs * share[axis])
        assert sd_m(edge, np.eye(3)[axis]) == pytest.approx(np.sqrt(least + FLOOR_M**2), rel=0.1)


def test_motions_are_carried_between_frames_by_the_adjoint():
    rng = np.random.default_rng(2)
    T = rigid(rotation_exp(rng.standard_normal(3)), rng.standard_normal(3))
    motion = 1e-5 * rng.standard_normal(6)
    here = rigid(rotation_exp(motion[:3]), motion[3:])
    np.testing.assert_allclose(small_motion(T @ here @ inverse(T)), adjoint(T) @ motion, atol=1e-9)
    turn = np.array([0.3, -2.0, 0.9])
    np.testing.assert_allclose(small_motion(rigid(rotation_exp(turn), np.ones(3)))[:3], turn, rtol=1e-9)
