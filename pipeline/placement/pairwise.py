"""Placement of a rig's nodes: pairwise registration, a pose graph, and both cameras' measurements."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations, pairwise

import numpy as np

from pipeline.config import NodePoints, RegistrationConfig
from pipeline.kernels import geometry
from pipeline.nodes import NodeClouds
from pipeline.placement.agreement import NOTHING_SHARED
from pipeline.placement.attempt import Attempt, accepted, attempt_anywhere, attempt_given
from pipeline.placement.edges import PoseEdge
from pipeline.placement.loops import Groups, best_loops
from pipeline.placement.outcome import NodeAgreement, NodeRegistration, NodeVerdict, Placement
from pipeline.placement.pairs import Candidates, Pair, UnknownPairs, given_pairs, neighbours_first
from pipeline.placement.pose_graph import PoseGraph, solve_pose_graph
from pipeline.placement.samples import NodeSample, both_ways, sample_of
from pipeline.placement.verdicts import verdicts_of
from pipeline.types import FloatArray, RgbdFrame


def place_nodes(
    frames: Sequence[RgbdFrame],
    nodes: Sequence[NodeClouds],
    config: RegistrationConfig,
    align_with: NodePoints = "sensor",
    candidates: Candidates = neighbours_first,
) -> Placement:
    """Place the nodes relative to each other by registering pairs, enough for a tree and loops.

    Nodes with known poses are registered to those earlier ones with the largest common view. Other pairs
    start from anywhere, the likeliest first, and count only if both cameras' measurements confirm them; they
    are tried until all nodes are joined and each is in loops. Registrations that contradict the measurements
    or their loops are rejected; the others give the poses by least squares. The first node with a known pose
    keeps it. A node with a known pose that no good registration reaches is placed relative to the earlier
    node with the largest common view; if their registration degenerates, by the given poses. A node without a
    pose that none reaches is excluded, and so is one whose measurements contradict the others' at its final
    pose.

    Args:
        frames: the nodes' images with their given poses.
        nodes: the clouds of the nodes.
        config: settings of the pairwise registration; with ``start="global"`` all poses count as unknown.
        align_with: which of a node's clouds is registered.
        candidates: orders the pairs with unknown common view, the likeliest to overlap first.
    """
    known = [config.start == "given" and frame.pose_known for frame in frames]
    if len(nodes) == 1:
        alone = NodeVerdict(nodes[0].name, True, NOTHING_SHARED)
        return Placement((), (frames[0].T_world_camera,), (alone,))
    samples = [sample_of(*node, config, align_with) for node in zip(frames, nodes, strict=True)]
    tried = _attempts(samples, nodes, config, align_with, known, candidates)
    edges = [attempt.edge for attempt in tried if attempt.edge is not None]
    reference, group = _reference(known, edges)
    graph = solve_pose_graph([sample.graph_points_m for sample in samples], edges, reference)
    poses = _poses(frames, graph.T_reference_node, reference, group, tried)
    agreements = {
        (source, target): both_ways(
            samples[source], samples[target], geometry.inverse(poses[target]) @ poses[source]
        )
        for target, source in combinations(group, 2)
    }
    names = [node.name for node in nodes]
    verdicts = verdicts_of(names, group, agreements, tried)
    return Placement(
        tuple(_registrations(names, tried, graph)),
        tuple(poses),
        tuple(verdicts),
        tuple(
            NodeAgreement(names[source], names[target], pair)
            for (source, target), pair in agreements.items()
            if verdicts[source].placed and verdicts[target].placed
        ),
    )


def _attempts(
    samples: Sequence[NodeSample],
    nodes: Sequence[NodeClouds],
    config: RegistrationConfig,
    align_with: NodePoints,
    known: Sequence[bool],
    candidates: Candidates,
) -> list[Attempt]:
    """Register all pairs that are worth it; those of given poses first, and of them each node's partner."""
    partners, others = given_pairs(samples, known)
    tried = []
    for source, target in (*partners, *others):
        here, there = samples[source], samples[target]
        T_init = geometry.inverse(there.frame.T_world_camera) @ here.frame.T_world_camera
        tried.append(attempt_given(here, there, (source, target), config, T_init))
    if all(known):
        return tried
    unknown = UnknownPairs(candidates(samples), known)
    while (pair := unknown.next(_sure_links(known, tried), len(nodes))) is not None:
        (source, target), joins = pair
        clouds = getattr(nodes[source], align_with), getattr(nodes[target], align_with)
        tried.append(
            attempt_anywhere(samples[source], samples[target], (source, target), clouds, config, joins)
        )
    return tried


def _sure_links(known: Sequence[bool], tried: Sequence[Attempt]) -> list[Pair]:
    """Return the pairs whose registrations agree with the measurements and with each other, and links between
    the nodes with known poses.
    """
    edges = [attempt.edge for attempt in tried if attempt.edge is not None]
    agreeing = best_loops(len(known), edges).agreeing(len(edges))
    links = [
        (edge.source, edge.target)
        for edge, agrees in zip(edges, agreeing, strict=True)
        if agrees and edge.agrees
    ]
    return links + list(pairwise(index for index, one in enumerate(known) if one))


def _registrations(
    names: Sequence[str], tried: Sequence[Attempt], graph: PoseGraph
) -> list[NodeRegistration]:
    """Return all attempts; those with a pose have their loop error and whether they were used."""
    found = iter(zip(graph.loop_error_m, graph.used, strict=True))
    return [
        NodeRegistration(
            names[attempt.source],
            names[attempt.target],
            attempt.result,
            *((float("nan"), False) if attempt.edge is None else next(found)),
            attempt.agreement,
        )
        for attempt in tried
    ]


def _reference(known: Sequence[bool], edges: Sequence[PoseEdge]) -> tuple[int, list[int]]:
    """Return the node whose pose is kept, and its group: the largest set of connected nodes."""
    links = [(edge.source, edge.target) for edge in edges if edge.agrees]
    links += pairwise(index for index, one in enumerate(known) if one)
    group = max(Groups(len(known), links).sets(), key=lambda group: (len(group), -min(group)))
    return min(group, key=lambda index: (not known[index], index)), sorted(group)


def _poses(
    frames: Sequence[RgbdFrame],
    T_reference_node: Sequence[FloatArray],
    reference: int,
    group: Sequence[int],
    tried: Sequence[Attempt],
) -> list[FloatArray]:
    """Return every node's pose, by the graph or relative to its partner; outside the group the given pose."""
    poses = [frame.T_world_camera for frame in frames]
    partner = {attempt.source: attempt for attempt in reversed(tried) if attempt.given}
    for index in group:
        if index == reference:
            continue
        T = T_reference_node[index]
        if np.isfinite(T).all():
            poses[index] = poses[reference] @ T
        elif index in partner:
            attempt = partner[index]
            T_target_node = (
                geometry.inverse(frames[attempt.target].T_world_camera) @ frames[index].T_world_camera
            )
            agreed = accepted(attempt.agreement, given=True)
            poses[index] = poses[attempt.target] @ (
                attempt.result.T_target_source if agreed else T_target_node
            )
    return poses
