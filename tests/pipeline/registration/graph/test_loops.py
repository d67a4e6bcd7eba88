"""Graphs with known poses: wrong edges are found, by the evidence that contradicts them, at any size."""

import time

import numpy as np
import pytest

from pipeline.kernels.geometry import inverse, rigid, rotation_exp
from pipeline.registration import point_error_m
from pipeline.registration.graph.edges import PoseEdge
from pipeline.registration.graph.loops import best_loops, loops_of
from pipeline.registration.graph.pose_graph import solve_pose_graph

TURN_RAD, SHIFT_M = 0.004, 0.008
"""Standard errors of the edges; with the slack of loops 0.005 and 0.01."""
INFORMATION = np.diag([TURN_RAD**-2] * 3 + [SHIFT_M**-2] * 3)
POINTS_M = np.random.default_rng(0).uniform(-2.0, 2.0, (200, 3))


def circle(nodes: int, radius_m: float) -> list[np.ndarray]:
    """Poses on a circle that look outwards."""
    turns = [rotation_exp(np.array([0.0, 0.0, 2.0 * np.pi * k / nodes])) for k in range(nodes)]
    return [rigid(turn, radius_m * turn[:, 0]) for turn in turns]


def noise(rng, times=1.0):
    motion = times * rng.standard_normal(6)
    return rigid(rotation_exp(TURN_RAD * motion[:3]), SHIFT_M * motion[3:])


def edge(truth, source, target, motion=None, strength=20.0):
    """An edge whose pose is the true one, then moved in the source's frame."""
    motion = np.eye(4) if motion is None else motion
    return PoseEdge(source, target, inverse(truth[target]) @ truth[source] @ motion, INFORMATION, strength)


AWAY = rigid(rotation_exp(np.array([0.0, 0.2, 0.1])), np.array([0.4, -0.2, 0.1]))


def rejected(nodes, edges):
    graph = solve_pose_graph([POINTS_M] * nodes, edges)
    return {place for place, used in enumerate(graph.used) if not used}, graph


def check(graph, truth, within_m):
    for pose, true in zip(graph.T_reference_node, truth, strict=True):
        assert point_error_m(truth[0] @ pose, true, POINTS_M) < within_m


def test_one_wrong_edge_among_right_ones_is_found_even_if_it_is_the_strongest():
    truth = circle(8, 2.0)
    right = [edge(truth, k, (k + apart) % 8) for k in range(8) for apart in (1, 2)]
    for broken in range(len(right)):
        one = right[broken]
        edges = list(right)
        edges[broken] = edge(truth, one.source, one.target, AWAY, 30.0)
        found, graph = rejected(8, edges)
        assert found == {broken}
        check(graph, truth, 1e-6)


@pytest.mark.parametrize(("strength", "wins"), [(9.0, True), (60.0, False)])
def test_two_wrong_edges_that_agree_lose_to_stronger_ones_and_only_to_these(strength, wins):
    truth = circle(5, 2.0)
    elsewhere = [*truth[:4], truth[4] @ AWAY]
    edges = [edge(truth, a, b) for a in range(4) for b in range(a)]
    edges += [edge(truth, 4, 0), edge(truth, 4, 1)]
    edges += [edge(elsewhere, 4, 2, strength=strength), edge(elsewhere, 4, 3, strength=strength)]
    found, graph = rejected(5, edges)
    assert found == ({8, 9} if wins else {6, 7})
    check(graph, truth if wins else elsewhere, 1e-6)


def test_what_is_no_loop_is_not_judged():
    truth = circle(6, 2.0)
    edges = [edge(truth, k, k - 1, AWAY if k == 3 else None) for k in range(1, 6)]
    found, graph = rejected(6, edges)
    assert not found
    assert np.isnan(graph.loop_error_m).all()


def test_a_loop_may_be_as_wrong_as_its_edges_together():
    """The expected squared distance of a loop of right edges is six, whatever its length, with noise as large
    as the error and the slack together.
    """
    rng, truth, distances = np.random.default_rng(5), circle(40, 3.0), []
    for _ in range(200):
        edges = [edge(truth, k, (k + 1) % 40, noise(rng, 1.25)) for k in range(40)]
        distances.append(loops_of(40, edges, range(39)).distance[0])
    assert np.mean(distances) == pytest.approx(6.0, rel=0.15)


def test_the_error_of_a_loop_is_the_length_by_which_it_fails_to_close():
    truth = circle(3, 1.0)
    aside = rigid(np.eye(3), np.array([0.03, 0.0, 0.0]))
    _, graph = rejected(3, [edge(truth, 1, 0), edge(truth, 2, 1), edge(truth, 2, 0, aside)])
    np.testing.assert_allclose(graph.loop_error_m[2], 0.03, rtol=1e-9)
    assert all(graph.used)


def test_two_hundred_nodes_with_wrong_edges_take_seconds():
    rng, truth = np.random.default_rng(0), circle(200, 10.0)
    edges = [edge(truth, k, (k - apart) % 200, noise(rng)) for k in range(200) for apart in (1, 2, 3)]
    wrong = set(rng.choice(len(edges), 60, replace=False).tolist())
    for place in wrong:
        one, strength = edges[place], 25.0 if place % 2 else 7.0
        motion = rigid(rotation_exp(0.3 * rng.standard_normal(3)), 0.5 * rng.standard_normal(3))
        edges[place] = edge(truth, one.source, one.target, motion, strength)
    for _ in range(20):
        wrong.add(len(edges))
        source, target = rng.choice(200, 2, replace=False).tolist()
        edges.append(edge(truth, source, target, noise(rng, 200.0), 7.0))
    started = time.process_time()
    found, graph = rejected(200, edges)
    assert time.process_time() - started < 10.0
    assert found == wrong
    check(graph, truth, 0.3)


def test_groups_without_a_link_keep_their_own_frames():
    truth = circle(6, 2.0)
    pairs = [(1, 0), (2, 1), (2, 0), (4, 3), (5, 4), (5, 3)]
    graph = solve_pose_graph([POINTS_M] * 6, [edge(truth, *pair) for pair in pairs], reference=4)
    reached = [bool(np.isfinite(pose).all()) for pose in graph.T_reference_node]
    assert reached == [False] * 3 + [True] * 3
    np.testing.assert_allclose(graph.T_reference_node[5], inverse(truth[4]) @ truth[5], atol=1e-9)
    loops = best_loops(6, [edge(truth, *pair) for pair in pairs])
    assert len(loops.closing) == 2
    assert not loops.passes[0] @ loops.passes[1]
