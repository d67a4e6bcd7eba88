"""Placement of a rig's nodes: pairwise registration, and verification by both cameras' measurements."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import reduce
from itertools import combinations, pairwise
from operator import add

import numpy as np

from packetmesh.errors import ReconstructionError
from pipeline.config import NodePoints, RegistrationConfig
from pipeline.kernels import geometry
from pipeline.nodes import NodeClouds
from pipeline.placement.agreement import NOTHING_SHARED, Agreement, agreement
from pipeline.placement.outcome import NodeAgreement, NodeRegistration, NodeVerdict, Placement
from pipeline.placement.pose_graph import (
    PoseEdge,
    graph_points,
    groups_of,
    pose_edge,
    solve_pose_graph,
    strongest_alike,
)
from pipeline.registration import register
from pipeline.registration.anywhere import register_anywhere
from pipeline.types import FloatArray, PointCloud, RegistrationResult, RgbdFrame

SHARED_VIEW = 0.25
"""Least share of a node's points in another's image for registering the two."""
LEAST_OVERLAP = 0.05
"""Least share of two nodes' points that the other camera can judge, for their agreement to count."""
LEAST_AGREEMENT = 0.4
"""A node with a given pose is excluded if a smaller share of its shared measurements is within 2 %."""
SURE_OVERLAP, SURE_AGREEMENT = 0.15, 0.88
"""Least overlap and agreement of a pose found without a first guess; a given one with less gets a warning.
At correct poses, nodes of rendered rigs reach .92 to .98 and those of a real SR300 .92 to .99; 3 degrees and
6 cm off .09 to .54; in another room up to .72; with one corner mistaken for the opposite .86."""
WIDER_GATES = 2.0, 4.0
"""Multiples of the configured gate, tried if given poses lead to a contradiction with the measurements."""


@dataclass(frozen=True, slots=True)
class _Tried:
    """The registration of one pair of nodes."""

    source: int
    target: int
    given: bool
    """Whether it started from given poses."""
    result: RegistrationResult
    agreement: Agreement

    @property
    def has_pose(self) -> bool:
        return bool(self.result.steps) and not self.result.stop_reason.startswith("degenerate")

    @property
    def agrees(self) -> bool:
        """Whether the measurements confirm it or, from given poses, do not contradict it."""
        return not _less(self.agreement, LEAST_AGREEMENT) if self.given else _confirmed(self.agreement)


def _less(found: Agreement, least: float) -> bool:
    """Return whether the overlap is large enough and the agreement below ``least``."""
    return found.overlap_share >= LEAST_OVERLAP and found.within_2pct_share < least


def _confirmed(found: Agreement) -> bool:
    return found.overlap_share >= SURE_OVERLAP and found.within_2pct_share >= SURE_AGREEMENT


def place_nodes(
    frames: Sequence[RgbdFrame],
    nodes: Sequence[NodeClouds],
    config: RegistrationConfig,
    align_with: NodePoints = "sensor",
) -> Placement:
    """Place the nodes relative to each other by registering all pairs with enough common view.

    Pairs with unknown poses start from anywhere, and count only if both cameras' measurements confirm them.
    Registrations that contradict the measurements or their loops are rejected; the others give the poses by
    least squares. The first node with a known pose keeps it. A node with a known pose that no good
    registration reaches is placed relative to the earlier node with the largest common view; if their
    registration degenerates, by the given poses. A node without a pose that none reaches is excluded, and
    so is one whose measurements contradict the others' at its final pose.

    Args:
        frames: the nodes' images with their given poses.
        nodes: the clouds of the nodes.
        config: settings of the pairwise registration; with ``start="global"`` all poses count as unknown.
        align_with: which of a node's clouds is registered.
    """
    known = [config.start == "given" and frame.pose_known for frame in frames]
    partners, others = _node_pairs(frames, nodes, known)
    tried: list[_Tried] = []
    for source, target in (*partners, *others):
        tried.append(_try(frames, nodes, config, align_with, known, tried, source, target))
    points_m = [graph_points(getattr(node, align_with)) for node in nodes]
    good = [place for place, trial in enumerate(tried) if trial.has_pose]
    edges = [
        pose_edge(trial.source, trial.target, points_m, trial.result.T_target_source, trial.agrees)
        for trial in (tried[place] for place in good)
    ]
    if not all(known):
        edges = strongest_alike(points_m, edges, [tried[place].agreement.within_2pct_share for place in good])
    reference, group = _reference(known, edges)
    graph = solve_pose_graph(points_m, edges, reference)
    found = {place: (graph.loop_error_m[k], graph.used[k]) for k, place in enumerate(good)}
    poses = _poses(frames, graph.T_reference_node, reference, group, tried)
    agreements = {
        (source, target): _both_ways(
            frames, nodes, source, target, geometry.inverse(poses[target]) @ poses[source]
        )
        for target, source in combinations(group, 2)
    }
    verdicts = _verdicts(nodes, group, agreements, tried)
    return Placement(
        _registrations(nodes, tried, found),
        tuple(poses),
        tuple(verdicts),
        tuple(
            NodeAgreement(nodes[source].name, nodes[target].name, pair)
            for (source, target), pair in agreements.items()
            if verdicts[source].placed and verdicts[target].placed
        ),
    )


def _registrations(
    nodes: Sequence[NodeClouds], tried: Sequence[_Tried], found: dict[int, tuple[float, bool]]
) -> tuple[NodeRegistration, ...]:
    """Return all attempts; those with a pose have their loop error and whether they were used."""
    return tuple(
        NodeRegistration(
            nodes[trial.source].name,
            nodes[trial.target].name,
            trial.result,
            *found.get(place, (float("nan"), False)),
            trial.agreement,
        )
        for place, trial in enumerate(tried)
    )


def _node_pairs(
    frames: Sequence[RgbdFrame], nodes: Sequence[NodeClouds], known: Sequence[bool]
) -> tuple[list[tuple[int, int]], list[tuple[int, int]]]:
    """Return (later, earlier) nodes: the best partner of each with a known pose, and the other pairs to try.

    If a pose is unknown, the common view is also unknown, and all pairs are tried.
    """
    partners, others = [], []
    for index in range(1, len(nodes)):
        shares = {
            k: _shared_view(frames[index], nodes[index].sensor.points_m, frames[k])
            for k in range(index)
            if known[index] and known[k]
        }
        partner = max(shares, key=lambda k: shares[k], default=None)
        if partner is not None:
            partners.append((index, partner))
        others += [
            (index, k) for k in range(index) if k != partner and shares.get(k, SHARED_VIEW) >= SHARED_VIEW
        ]
    return partners, others


def _shared_view(frame: RgbdFrame, points_m: FloatArray, other: RgbdFrame) -> float:
    """Return the share of a node's points that project into another node's image, by the given poses."""
    T_other_camera = geometry.inverse(other.T_world_camera) @ frame.T_world_camera
    seen_m = geometry.apply(T_other_camera, points_m[::50])
    seen_m = seen_m[seen_m[:, 2] > 0.1]
    uv = geometry.project(other.intrinsics, seen_m)
    size_px = (other.intrinsics.width_px, other.intrinsics.height_px)
    return float(np.all((uv >= 0) & (uv < size_px), axis=1).sum()) / max(1, len(points_m) // 50)


def _try(
    frames: Sequence[RgbdFrame],
    nodes: Sequence[NodeClouds],
    config: RegistrationConfig,
    align_with: NodePoints,
    known: Sequence[bool],
    before: Sequence[_Tried],
    source: int,
    target: int,
) -> _Tried:
    """Register one node's cloud to another's, from the given poses or from anywhere."""
    moving, fixed = (getattr(nodes[index], align_with) for index in (source, target))
    T_init = geometry.inverse(frames[target].T_world_camera) @ frames[source].T_world_camera
    given = known[source] and known[target]

    def judged(T_target_source: FloatArray) -> Agreement:
        return _both_ways(frames, nodes, source, target, T_target_source)

    try:
        if given:
            result = _register_given(moving, fixed, config, T_init, judged)
        else:
            linked = any({source, target} <= group for group in groups_of(len(nodes), _links(before)))
            result = register_anywhere(
                moving, fixed, config, lambda T: _score(judged(T)), SURE_AGREEMENT, thorough=not linked
            )
    except ReconstructionError as error:
        return _Tried(
            source, target, given, RegistrationResult(T_init, (), False, str(error)), NOTHING_SHARED
        )
    return _Tried(source, target, given, result, judged(result.T_target_source))


def _register_given(
    moving: PointCloud,
    fixed: PointCloud,
    config: RegistrationConfig,
    T_init: FloatArray,
    judged: Callable[[FloatArray], Agreement],
) -> RegistrationResult:
    """Register from a given pose; if the measurements contradict the result, try wider gates."""
    result = register(moving, fixed, config, T_init)
    if _less(judged(result.T_target_source), LEAST_AGREEMENT):
        for gate_m in (times * config.gate_m for times in WIDER_GATES):
            wider = register(moving, fixed, replace(config, gate_m=gate_m), T_init)
            if _confirmed(judged(wider.T_target_source)):
                return wider
    return result


def _links(tried: Sequence[_Tried]) -> list[tuple[int, int]]:
    return [(trial.source, trial.target) for trial in tried if trial.has_pose and trial.agrees]


def _score(found: Agreement) -> float:
    """Score a pose found from anywhere: its agreement, or 0 if the overlap is too small."""
    return found.within_2pct_share if found.overlap_share >= SURE_OVERLAP else 0.0


def _both_ways(
    frames: Sequence[RgbdFrame], nodes: Sequence[NodeClouds], source: int, target: int, T: FloatArray
) -> Agreement:
    """Compute the agreement of two nodes at a pose T_target_source, counted in the points of both."""
    there, back = frames[target], frames[source]
    return agreement(nodes[source].sensor, T, there.intrinsics, there.depth) + agreement(
        nodes[target].sensor, geometry.inverse(T), back.intrinsics, back.depth
    )


def _reference(known: Sequence[bool], edges: Sequence[PoseEdge]) -> tuple[int, list[int]]:
    """Return the node whose pose is kept, and its group: the largest set of connected nodes."""
    believers = [index for index, one in enumerate(known) if one]
    links = [(edge.source, edge.target) for edge in edges if edge.agrees]
    links += pairwise(believers)
    group = max(groups_of(len(known), links), key=lambda group: (len(group), -min(group)))
    return min(group, key=lambda index: (not known[index], index)), sorted(group)


def _poses(
    frames: Sequence[RgbdFrame],
    T_reference_node: Sequence[FloatArray],
    reference: int,
    group: Sequence[int],
    tried: Sequence[_Tried],
) -> list[FloatArray]:
    """Return every node's pose, by the graph or relative to its partner; outside the group the given pose."""
    poses = [frame.T_world_camera for frame in frames]
    partner = {trial.source: trial for trial in reversed(tried) if trial.given}
    for index in group:
        if index == reference:
            continue
        T = T_reference_node[index]
        if np.isfinite(T).all():
            poses[index] = poses[reference] @ T
        elif index in partner:
            trial = partner[index]
            T_target_node = (
                geometry.inverse(frames[trial.target].T_world_camera) @ frames[index].T_world_camera
            )
            agreed = trial.result.T_target_source if trial.agrees else T_target_node
            poses[index] = poses[trial.target] @ agreed
    return poses


def _verdicts(
    nodes: Sequence[NodeClouds],
    group: Sequence[int],
    agreements: dict[tuple[int, int], Agreement],
    tried: Sequence[_Tried],
) -> list[NodeVerdict]:
    """Exclude the worst contradicting node until none contradicts; find doubtful nodes in the same way."""

    def beside(others: set[int], node: int) -> Agreement:
        pairs = (pair for pair in agreements if node in pair and set(pair) - {node} <= others)
        enough = (agreements[pair] for pair in pairs if agreements[pair].overlap_share >= LEAST_OVERLAP)
        return reduce(add, enough, NOTHING_SHARED)

    def without_worst(kept: set[int], least: float) -> set[int]:
        while suspects := [index for index in kept if _less(beside(kept, index), least)]:
            kept = kept - {min(suspects, key=lambda index: (beside(kept, index).within_2pct_share, -index))}
        return kept

    placed = without_worst(set(group), LEAST_AGREEMENT)
    sure = without_worst(placed, SURE_AGREEMENT)
    verdicts = []
    for index, node in enumerate(nodes):
        found, sentence = beside(placed, index), ""
        if index not in group:
            sentence = _lost(nodes, index, tried)
        elif index not in placed:
            sentence = _contradiction(node.name, found)
        elif index not in sure:
            sentence = (
                f"{node.name} fits the others badly: of what they both measured, "
                f"{found.within_2pct_share:.0%} is within 2 %; check its pose and its calibration"
            )
        elif not found.shared and len(placed) > 1:
            sentence = f"{node.name} stands by its given pose alone: no other camera measured what it sees"
        verdicts.append(NodeVerdict(node.name, index in placed, found, sentence))
    return verdicts


def _contradiction(name: str, found: Agreement) -> str:
    """Return why a node with a pose is excluded."""
    return (
        f"{name} is left out: of what it and the others both measured, only {found.within_2pct_share:.0%} is "
        "within 2 %; check its pose and that all nodes saw the same scene, or try --set "
        "node_registration.start=global"
    )


def _lost(nodes: Sequence[NodeClouds], index: int, tried: Sequence[_Tried]) -> str:
    """Return why a node is connected to no other."""
    mine = [trial for trial in tried if index in (trial.source, trial.target)]
    best = max(mine, key=lambda trial: (_score(trial.agreement), trial.agreement.shared))
    other = nodes[best.target if best.source == index else best.source].name
    why = f"beside {other}: {best.result.stop_reason.partition(';')[0].rstrip('.')}"
    if best.agreement.shared:
        why = (
            f"of what it and {other} both measured where it fits best, "
            f"{best.agreement.within_2pct_share:.0%} is within 2 %"
        )
    return (
        f"{nodes[index].name} is left out: its pose is not known, and it fits nowhere beside the others "
        f"({why}); try to give its pose, or images that share more of the place"
    )
