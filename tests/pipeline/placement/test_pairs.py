"""Pairs are chosen so that their number grows with the nodes, not with all pairs."""

import numpy as np

from pipeline.kernels.geometry import look_at
from pipeline.placement.loops import Groups
from pipeline.placement.pairs import GIVEN_PAIRS, UnknownPairs, given_pairs, neighbours_first
from pipeline.placement.samples import NodeSample
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


def tried_until_enough(count, sure, known=None):
    """Pairs that are tried if those for which ``sure`` is true succeed."""
    pairs = UnknownPairs(neighbours_first([None] * count), known or [False] * count)
    links, tried = [], []
    while (found := pairs.next(links, count)) is not None:
        tried.append(found[0])
        if sure(*found[0]):
            links.append(found[0])
    return tried, links


def test_twenty_nodes_in_a_row_need_three_pairs_each_and_not_all():
    tried, links = tried_until_enough(20, lambda one, other: abs(one - other) <= 3)
    assert len(tried) <= 3 * 20
    assert len(set(tried)) == len(tried)
    assert len(Groups(20, links).sets()) == 1
    assert min(sum(node in link for link in links) for node in range(20)) >= 3


def test_nodes_in_a_mixed_order_are_joined_all_the_same():
    order = np.random.default_rng(1).permutation(12)
    _, links = tried_until_enough(12, lambda one, other: abs(order[one] - order[other]) <= 2)
    assert len(Groups(12, links).sets()) == 1


def test_a_stranger_is_tried_beside_every_other_before_it_is_given_up():
    tried, links = tried_until_enough(6, lambda one, other: 2 not in (one, other))
    assert {pair for pair in tried if 2 in pair} == {(2, 0), (2, 1), (3, 2), (4, 2), (5, 2)}
    assert len(Groups(6, links).sets()) == 2


def test_pairs_of_nodes_with_poses_are_not_tried_without_them():
    tried, _ = tried_until_enough(4, lambda one, other: True, [True, True, False, True])
    assert all(2 in pair for pair in tried)


def test_nodes_with_poses_have_a_partner_and_a_few_loops_and_the_ring_closes():
    partners, others = given_pairs(nodes_around(24), [True] * 24)
    assert [source for source, _ in partners] == list(range(1, 24))
    assert len(partners) + len(others) <= GIVEN_PAIRS * 24
    links = set(partners) | set(others)
    assert {(k, k - 1) for k in range(1, 24)} | {(23, 0)} <= links
    assert all(min(a - b, 24 - a + b) <= 3 for a, b in others)
