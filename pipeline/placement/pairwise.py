"""Placement of a rig's nodes: pairwise registration, a pose graph, and both cameras' measurements."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import combinations, pairwise

import numpy as np

from pipeline.config import NodePoints, RegistrationConfig
from pipeline.kernels import geometry
from pipeline.nodes import NodeClouds
from pipeline.placement.agreement import NOTHING_SHARED, Agreement
from pipeline.placement.attempt import Attempt, attempt_given
from pipeline.placement.given import given_edges, is_loose, loose_nodes, with_given_poses
from pipeline.placement.outcome import NodeAgreement, NodeRegistration, NodeVerdict, Placement
from pipeline.placement.pairs import given_pairs
from pipeline.placement.samples import NodeSample, both_ways, sample_of, shared_view
from pipeline.placement.unknown import UnknownPoses
from pipeline.placement.verdicts import verdicts_of
from pipeline.placement.views import Views
from pipeline.registration.graph.edges import PoseEdge, adjoint
from pipeline.registration.graph.loops import Groups
from pipeline.registration.graph.pose_graph import PoseGraph, motion_covariances, solve_pose_graph
from pipeline.types import FloatArray, RgbdFrame


def place_nodes(
    frames: Sequence[RgbdFrame],
    nodes: Sequence[NodeClouds],
    config: RegistrationConfig,
    align_with: NodePoints = "sensor",
) -> Placement:
    """Place the nodes relative to each other by registering pairs, enough for a tree and loops.

    Nodes with known poses are registered to those earlier ones with the largest common view; the others are
    searched for (``UnknownPoses``). Registrations that contradict the measurements or their loops are
    rejected; the others give the poses by least squares. Only one group of connected nodes is placed: that of
    the nodes with known poses, which count as connected; or the largest one if no pose is known, or only that
    of a node that joins no other. Its first node with a known pose keeps it. A node of the group with a known
    pose that no good registration reaches is placed relative to the earlier node with the largest common
    view; if the measurements refute that too, by the given poses. A node outside the group is excluded, and
    so is one whose measurements contradict the others' at its final pose.

    Args:
        frames: the nodes' images with their given poses.
        nodes: the clouds of the nodes.
        config: settings of the pairwise registration; with ``start="global"`` all poses count as unknown.
        align_with: which of a node's clouds is registered.
    """
    known = [config.start == "given" and frame.pose_known for frame in frames]
    if len(nodes) == 1:
        alone = NodeVerdict(nodes[0].name, True, NOTHING_SHARED)
        return Placement((), (frames[0].T_world_camera,), (alone,), covariances=(np.zeros((6, 6)),))
    samples = [sample_of(*node, config, align_with) for node in zip(frames, nodes, strict=True)]
    tried = _from_given_poses(samples, known, config)
    if not all(known):
        tried = UnknownPoses(samples, known, config, Views(frames, config.seed), tried).attempts()
    edges = [attempt.edge for attempt in tried if attempt.edge is not None]
    reference, group = _reference(known, edges)
    graph = solve_pose_graph([sample.graph_points_m for sample in samples], edges, reference)
    held = [edge for edge, used in zip(edges, graph.used, strict=True) if used]
    loose = loose_nodes(graph, held, reference)
    if any(is_loose(edge) for edge in held):
        given = given_edges([frame.T_world_camera for frame in frames], known, graph, reference)
        graph = with_given_poses(graph, held, given, reference)
        held += given
    poses = _poses(frames, graph.T_reference_node, reference, group, tried)
    covariances = motion_covariances(graph.T_reference_node, held, reference)
    to_world = adjoint(poses[reference])
    agreements = dict(_agreements(samples, poses, group))
    names = [node.name for node in nodes]
    verdicts = verdicts_of(names, known, group, agreements, tried, [node for node in loose if known[node]])
    return Placement(
        tuple(_registrations(names, tried, graph)),
        tuple(poses),
        tuple(verdicts),
        tuple(
            NodeAgreement(names[source], names[target], pair)
            for (source, target), pair in agreements.items()
            if verdicts[source].placed and verdicts[target].placed
        ),
        tuple(to_world @ covariance @ to_world.T for covariance in covariances),
    )


def _from_given_poses(
    samples: Sequence[NodeSample], known: Sequence[bool], config: RegistrationConfig
) -> list[Attempt]:
    """Register the nodes with known poses; each node's partner first."""
    poses = [sample.frame.T_world_camera for sample in samples]
    partners, others = given_pairs(samples, poses, [0 if one else None for one in known])
    return [
        attempt_given(
            samples[source],
            samples[target],
            (source, target),
            config,
            geometry.inverse(poses[target]) @ poses[source],
        )
        for source, target in (*partners, *others)
    ]


def _agreements(
    samples: Sequence[NodeSample], poses: Sequence[FloatArray], group: Sequence[int]
) -> Iterable[tuple[tuple[int, int], Agreement]]:
    """Yield the agreement of all pairs of nodes of a group of which one sees points of the other."""
    for target, source in combinations(group, 2):
        here, there = samples[source], samples[target]
        seen = shared_view(here, there, poses[source], poses[target])
        if seen or shared_view(there, here, poses[target], poses[source]):
            T_target_source = geometry.inverse(poses[target]) @ poses[source]
            yield (source, target), both_ways(here, there, T_target_source)


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
    """Return the node whose pose is kept, and the group of connected nodes that is placed.

    Nodes with known poses count as connected. Of groups of several nodes theirs is placed, so that the poses
    are in their frame; without it the largest.
    """
    posed = [index for index, one in enumerate(known) if one]
    links = [(edge.source, edge.target) for edge in edges if edge.agrees]
    groups = Groups(len(known), [*links, *pairwise(posed)]).sets()
    several = [group for group in groups if len(group) > 1] or groups
    group = max(several, key=lambda group: (not group.isdisjoint(posed), len(group), -min(group)))
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
            poses[index] = poses[attempt.target] @ (
                T_target_node if attempt.refuted else attempt.result.T_target_source
            )
    return poses
