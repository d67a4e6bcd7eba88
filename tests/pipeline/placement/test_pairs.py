"""Pairs are chosen so that their number grows with the nodes, not with all pairs."""

import numpy as np

from pipeline.kernels.geometry import look_at
from pipeline.placement.pairs import (
    BRIDGE_TRIES,
    GIVEN_PAIRS,
    GROUP_TRIES,
    LONE_TRIES,
    JoiningPairs,
    across_bridges,
    given_pairs,
    likeliest_first,
    lone_tries,
)
from pipeline.placement.samples import NodeSample
from pipeline.registration.graph.loops import Groups
from pipeline.types import CameraIntrinsics, DepthMap, PointCloud, RgbdFrame

CAMERA = CameraIntrinsics.pinhole(60.0, 60.0, 39.5, 29.5, 80, 60)


def nodes_around(count):
    """Cameras in the middle of a cylinder that look outwards, with the points that they see."""
    rays = np.stack(np.meshgrid(np.linspace(-0.6, 0.6, 30), np.linspace(-0.4, 0.4, 20), [1.0]), axis=-1)
    points_m = 2.0 * rays.reshape(-1, 3)
    nodes = []
    for k in range(count):
        turn = 2.0 * np.pi * k / count
        pose = look_at(np.zeros(3), np.array([np.cos(turn), np.sin(turn), 0.0]))
        depth = DepthMap(np.full((60, 80), 2.0, np.float32))
        frame = RgbdFrame(f"node_{k:02d}", np.zeros((60, 80, 3), np.uint8), depth, CAMERA, pose)
        nodes.append(NodeSample(frame, PointCloud(points_m), PointCloud(points_m)))
    return nodes


def joined(order, tries, sure, links=()):
    """Pairs that are tried, and the links, if those for which ``sure`` is true succeed."""
    pairs, tried, links = JoiningPairs(order, tries), [], list(links)
    while (pair := pairs.next(links)) is not None:
        tried.append(pair)
        if sure(*pair):
            links.append(pair)
    return tried, links


def alike(one, other):
    return 0.0


def test_twenty_nodes_in_a_row_need_a_tree_and_not_all_pairs():
    order = likeliest_first([False] * 20, alike)
    tried, links = joined(order, [40] * 20, lambda one, other: abs(one - other) <= 3)
    assert tried == links == [(k, k - 1) for k in range(1, 20)]


def test_images_that_are_alike_come_first_and_of_equal_ones_neighbours():
    order = likeliest_first([False] * 4, lambda one, other: 9.0 if (one, other) == (3, 0) else 1.0)
    assert order == [(3, 0), (1, 0), (2, 1), (3, 2), (2, 0), (3, 1)]


def test_pairs_of_nodes_with_poses_are_not_tried_without_them():
    order = likeliest_first([True, True, False, True], alike)
    assert sorted(order) == [(2, 0), (2, 1), (3, 2)]


def test_nodes_in_a_mixed_order_are_joined_all_the_same():
    places = np.random.default_rng(1).permutation(12)
    order = likeliest_first([False] * 12, alike)
    _, links = joined(order, [LONE_TRIES] * 12, lambda one, other: abs(places[one] - places[other]) <= 2)
    assert len(Groups(12, links).sets()) == 1


def test_a_stranger_is_tried_beside_every_other_before_it_is_given_up():
    order = likeliest_first([False] * 6, alike)
    tried, links = joined(order, lone_tries(6, []), lambda one, other: 2 not in (one, other))
    assert {pair for pair in tried if 2 in pair} == {(2, 0), (2, 1), (3, 2), (4, 2), (5, 2)}
    assert len(Groups(6, links).sets()) == 2


def test_a_stranger_among_many_costs_few_tries_and_two_groups_a_few_a_node():
    chain = [(k, k - 1) for k in range(1, 60)]
    order = likeliest_first([False] * 61, alike)
    tried, _ = joined(order, lone_tries(61, chain), lambda one, other: False, chain)
    assert len(tried) == LONE_TRIES
    assert all(60 in pair for pair in tried)
    halves = [link for link in chain if link != (20, 19)]
    tried, _ = joined(
        order[:], lone_tries(61, [*halves, (60, 59)]), lambda one, other: False, [*halves, (60, 59)]
    )
    assert len(tried) == 20 * GROUP_TRIES


def test_pairs_across_a_bridge_are_the_likeliest_and_loops_have_none():
    ring, tail = [(1, 0), (2, 1), (2, 0)], [(3, 2), (4, 3), (4, 2)]
    candidates = [(4, 1), (4, 0), (3, 1), (3, 0)]
    assert list(across_bridges(candidates, [*ring, *tail], 5)) == []
    bridged = [*ring, (3, 2), (4, 3)]
    assert list(across_bridges(candidates, bridged, 5)) == candidates[:BRIDGE_TRIES]


def test_nodes_with_poses_have_a_partner_and_a_few_loops_and_the_ring_closes():
    nodes = nodes_around(24)
    poses = [node.frame.T_world_camera for node in nodes]
    partners, others = given_pairs(nodes, poses, [0] * 24)
    assert [source for source, _ in partners] == list(range(1, 24))
    assert len(partners) + len(others) <= GIVEN_PAIRS * 24
    links = set(partners) | set(others)
    assert {(k, k - 1) for k in range(1, 24)} | {(23, 0)} <= links
    assert all(min(a - b, 24 - a + b) <= 3 for a, b in others)


def test_nodes_in_different_frames_are_no_pair():
    nodes = nodes_around(4)
    poses = [node.frame.T_world_camera for node in nodes]
    partners, others = given_pairs(nodes, poses, [0, 0, None, 3])
    assert (partners, others) == ([(1, 0)], [])
