"""Loops betray a wrong registration, and all right ones together beat the chain."""

from dataclasses import replace

import numpy as np
import pytest

from lab.worlds import box_room
from pipeline.config import RegistrationConfig
from pipeline.kernels.geometry import inverse, rigid, rotation_exp
from pipeline.kernels.open3d_runtime import o3d
from pipeline.registration import point_error_m, register
from pipeline.registration.graph.edges import PoseEdge, registration_information
from pipeline.registration.graph.loops import loops_of, spanning_forest
from pipeline.registration.graph.pose_graph import optimised, solve_pose_graph
from pipeline.registration.neighbourhood import pca_normals
from tests.pipeline.registration.rooms import seen_by

NODES = 6
APART = 2
"""Nodes up to this far apart on the arc share enough of their views (50 degrees)."""
STRONG, WEAK = 20.0, 5.0


def small_motion(rng: np.random.Generator, angle_rad: float, length_m: float) -> np.ndarray:
    axis, way = (v / np.linalg.norm(v) for v in rng.standard_normal((2, 3)))
    return rigid(rotation_exp(angle_rad * axis), length_m * way)


@pytest.fixture(scope="module")
def ring():
    """Six nodes' points, their true poses in the frame of the first, and registered edges."""
    scene = box_room(6, nodes=NODES)
    clouds = seen_by(scene, noise_m=0.002)
    truth = [inverse(scene.cameras[0]) @ camera for camera in scene.cameras]
    points_m = [cloud.points_m[::40] for cloud in clouds]
    normals = [pca_normals(cloud.points_m) for cloud in clouds]
    rng = np.random.default_rng(4)
    edges = []
    for source in range(NODES):
        for target in range(max(0, source - APART), source):
            T_true = inverse(truth[target]) @ truth[source]
            T_init = small_motion(rng, np.radians(3.0), 0.06) @ T_true
            result = register(clouds[source], clouds[target], RegistrationConfig(), T_init)
            information = registration_information(
                result, clouds[source].points_m, normals[source], normals[target]
            )
            edges.append(PoseEdge(source, target, result.T_target_source, information, STRONG))
    return points_m, truth, edges


def worst_error_m(ring, poses) -> float:
    points_m, truth, _ = ring
    return max(point_error_m(*pair, points) for *pair, points in zip(poses, truth, points_m, strict=True))


def moved(edge, motion, strength=STRONG):
    return replace(edge, T_target_source=motion @ edge.T_target_source, strength=strength)


def chain_of(edges):
    return [edge for edge in edges if edge.source - edge.target == 1]


def along(edges):
    return loops_of(NODES, edges, spanning_forest(NODES, edges, range(len(edges)))).T_root_node


def test_a_ring_of_six_closes(ring):
    points_m, _, edges = ring
    graph = solve_pose_graph(points_m, edges)
    assert all(graph.used)
    assert max(graph.loop_error_m) < 0.02
    assert worst_error_m(ring, graph.T_reference_node) < 0.02


@pytest.mark.parametrize("broken", range(9))
def test_a_broken_edge_is_rejected_and_the_poses_stay_right(ring, broken):
    points_m, _, edges = ring
    damage = small_motion(np.random.default_rng(broken), np.radians(8.0), 0.25)
    edges = [moved(edge, damage, WEAK) if k == broken else edge for k, edge in enumerate(edges)]
    graph = solve_pose_graph(points_m, edges)
    assert graph.used == tuple(k != broken for k in range(len(edges)))
    assert graph.loop_error_m[broken] > 0.1
    assert worst_error_m(ring, graph.T_reference_node) < 0.02


def test_the_graph_beats_the_chain_on_noisy_edges(ring):
    points_m, _, edges = ring
    ratios = []
    for seed in range(10):
        rng = np.random.default_rng(seed)
        noisy = [moved(edge, small_motion(rng, np.radians(0.3), 0.01)) for edge in edges]
        graph = solve_pose_graph(points_m, noisy)
        assert all(graph.used)
        ratios.append(
            worst_error_m(ring, graph.T_reference_node) / worst_error_m(ring, along(chain_of(noisy)))
        )
    assert np.median(ratios) < 0.8


def test_a_tree_is_its_chain_and_has_no_loops(ring):
    points_m, _, edges = ring
    chain = chain_of(edges)
    graph = solve_pose_graph(points_m, chain)
    assert np.isnan(graph.loop_error_m).all()
    pose = np.eye(4)
    for edge, got in zip(chain, graph.T_reference_node[1:], strict=True):
        pose = pose @ edge.T_target_source
        np.testing.assert_allclose(got, pose, atol=1e-12)


def test_a_node_without_an_edge_has_no_pose(ring):
    points_m, _, edges = ring
    graph = solve_pose_graph(points_m, [edge for edge in edges if 5 not in (edge.source, edge.target)])
    assert np.isnan(graph.T_reference_node[5]).all()
    assert worst_error_m(ring, [*graph.T_reference_node[:5], ring[1][5]]) < 0.02


def test_the_order_of_the_edges_does_not_matter(ring):
    points_m, _, edges = ring
    forward, backward = solve_pose_graph(points_m, edges), solve_pose_graph(points_m, edges[::-1])
    np.testing.assert_allclose(forward.T_reference_node, backward.T_reference_node, atol=1e-6)
    np.testing.assert_allclose(forward.loop_error_m, backward.loop_error_m[::-1])


def test_the_poses_are_open3ds(ring):
    """The same minimum by another program, which has other parameters of a turn."""
    _, _, edges = ring
    rng = np.random.default_rng(3)
    noisy = [moved(edge, small_motion(rng, np.radians(0.3), 0.01)) for edge in edges]
    start = along(noisy)
    theirs = o3d.pipelines.registration
    graph = theirs.PoseGraph()
    for pose in start:
        graph.nodes.append(theirs.PoseGraphNode(pose))
    for edge in noisy:
        graph.edges.append(
            theirs.PoseGraphEdge(edge.source, edge.target, edge.T_target_source, edge.information, False)
        )
    theirs.global_optimization(
        graph,
        theirs.GlobalOptimizationLevenbergMarquardt(),
        theirs.GlobalOptimizationConvergenceCriteria(),
        theirs.GlobalOptimizationOption(0.05, 0.25, 1.0, 0),
    )
    ours, _ = optimised(start, noisy)
    for pose, node in zip(ours, graph.nodes, strict=True):
        np.testing.assert_allclose(pose, node.pose, atol=2e-4)
    assert np.abs(ours - start).max() > 2e-3


@pytest.mark.parametrize("seed", [4, 8])
def test_poses_along_a_bare_wall_do_not_run_away(seed):
    """Three motions are open there; full steps of Gauss and Newton end 10^37 m away."""
    rng, edges = np.random.default_rng(seed), []
    poses = [rigid(rotation_exp(rng.normal(0.0, 0.1, 3)), np.array([0.1 * k, 0.0, 0.0])) for k in range(12)]
    information = np.diag([1e5, 1e5, 0.1, 0.1, 0.1, 1e6])
    for source in range(len(poses)):
        for target in range(max(0, source - 3), source):
            turned = rotation_exp(np.array([0.0, 0.0, rng.normal()]))
            slipped = rigid(turned, np.array([*rng.normal(0.0, 0.4, 2), 0.0]))
            motion = np.linalg.inv(poses[target]) @ poses[source] @ slipped
            edges.append(PoseEdge(source, target, motion, information, 1.0))
    start = [np.eye(4)]
    for edge in edges:
        if edge.target == edge.source - 1:
            start.append(start[-1] @ edge.T_target_source)
    solved, distance = optimised(np.array(start), edges)
    assert distance.sum() < 50.0
    assert np.linalg.norm(solved[:, :3, 3], axis=1).max() < 2.0
