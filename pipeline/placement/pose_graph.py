"""Pose graph of a rig: loops reveal wrong registrations, least squares reconciles the others."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial import cKDTree

from pipeline.kernels.geometry import apply, inverse
from pipeline.kernels.open3d_runtime import o3d
from pipeline.registration.metrics import point_error_m
from pipeline.registration.neighbourhood import median_spacing_m
from pipeline.types import FloatArray, PointCloud

LOOP_TOLERANCE_M = 0.05
"""Largest error of a loop of correct registrations: a few times the 2 cm of a single one (SPEC 4.7)."""
INFORMATION_GATE_M = 0.05
"""Largest distance of pairs, at the registered pose, that count as evidence for it."""
FIT_GATE_M = 0.3
"""Points farther than this from the other cloud are outside the overlap."""
GRAPH_POINTS = 4000
"""Most points of a node that the graph uses."""


@dataclass(frozen=True, slots=True)
class PoseEdge:
    """A registration as evidence for the relative pose of two nodes."""

    source: int
    target: int
    T_target_source: FloatArray
    """(4, 4) registered pose."""
    information: FloatArray
    """(6, 6) sum of J^T J over the close pairs; rotations first, as in Open3D."""
    misfit_m: float
    """Median distance of the source's points from the target in their overlap; of contradicting edges, that
    with the largest is rejected first."""
    agrees: bool = True
    """False for an edge that other evidence contradicts: it determines no pose and checks no loop."""

    @property
    def pairs(self) -> float:
        """Number of close pairs in the information."""
        return float(self.information[5, 5])


@dataclass(frozen=True, slots=True)
class PoseGraph:
    """Solution of a pose graph, with edges in the given order."""

    T_reference_node: tuple[FloatArray, ...]
    """(4, 4) pose of every node in the reference's frame; NaN for nodes that no used edge reaches."""
    loop_error_m: tuple[float, ...]
    """Point error between each edge and the path between its nodes, along edges that nothing else
    contradicts, that agrees with it best; NaN without a path."""
    used: tuple[bool, ...]
    """False for edges that were rejected because they contradict the loops."""


def graph_points(cloud: PointCloud) -> FloatArray:
    """Draw at most ``GRAPH_POINTS`` (N, 3) points of a node."""
    if len(cloud) <= GRAPH_POINTS:
        return cloud.points_m
    return cloud.points_m[np.random.default_rng(0).choice(len(cloud), GRAPH_POINTS, replace=False)]


def pose_edge(
    source: int,
    target: int,
    points_m: Sequence[FloatArray],
    T_target_source: FloatArray,
    agrees: bool = True,
) -> PoseEdge:
    """Compute the evidence for a registered pose from the nodes' points.

    The information follows Choi, Zhou, Koltun 2015, eq. 10: the Gauss-Newton matrix of the distances of
    matched points.
    """
    moved_m = apply(T_target_source, points_m[source])
    distances_m, nearest = cKDTree(points_m[target]).query(moved_m, workers=-1)
    gate_m = max(INFORMATION_GATE_M, median_spacing_m(points_m[target]))
    close = points_m[target][nearest[distances_m <= gate_m]]
    overlap_m = distances_m[distances_m <= FIT_GATE_M]
    return PoseEdge(
        source,
        target,
        np.asarray(T_target_source, dtype=np.float64),
        _information(close),
        float(np.median(overlap_m)) if len(overlap_m) else float("inf"),
        agrees,
    )


def _information(points_m: FloatArray) -> FloatArray:
    """Return the (6, 6) sum over points of J^T J, J = [-[p]x, I]."""
    x, y, z = points_m.T
    zero = np.zeros_like(x)
    skew = np.stack([zero, z, -y, -z, zero, x, y, -x, zero], axis=1).reshape(-1, 3, 3)
    jacobian = np.concatenate([skew, np.broadcast_to(np.eye(3), skew.shape)], axis=2)
    return np.einsum("nki,nkj->ij", jacobian, jacobian)


def groups_of(nodes: int, links: Iterable[tuple[int, int]]) -> list[set[int]]:
    """Return the connected groups of nodes, ordered by their first nodes."""
    groups = [{node} for node in range(nodes)]
    for link in links:
        one, other = (next(group for group in groups if node in group) for node in link)
        if one is not other:
            one |= other
            groups.remove(other)
    return sorted(groups, key=min)


def strongest_alike(
    points_m: Sequence[FloatArray], edges: Sequence[PoseEdge], strengths: Sequence[float]
) -> list[PoseEdge]:
    """Mark edges as not agreeing if they contradict the path along stronger edges.

    Poses found from anywhere can be wrong in the same way, such as a view mistaken for that of the opposite
    corner: two such edges form a consistent loop. So stronger evidence wins.

    Args:
        points_m: as for ``solve_pose_graph``.
        edges: the registrations.
        strengths: strength of each edge's evidence.
    """
    judged = list(edges)
    kept: list[PoseEdge] = []
    for place in sorted(range(len(edges)), key=lambda place: -strengths[place]):
        edge = edges[place]
        if not edge.agrees:
            continue
        T_target_source = chained(len(points_m), kept, edge.target)[edge.source]
        error_m = point_error_m(T_target_source, edge.T_target_source, points_m[edge.source])
        if error_m > LOOP_TOLERANCE_M:
            judged[place] = replace(edge, agrees=False)
        else:  # without another path the error is NaN, which is no contradiction
            kept.append(edge)
    return judged


def solve_pose_graph(
    points_m: Sequence[FloatArray], edges: Sequence[PoseEdge], reference: int = 0
) -> PoseGraph:
    """Compute the poses that agree best with the edges, after rejecting edges that contradict the loops.

    Args:
        points_m: (N, 3) points of every node, in its own frame, at which errors are measured.
        edges: the registrations, at most one per pair of nodes.
        reference: node whose pose is the identity.
    """
    used = _consistent(points_m, edges)
    kept = [edge for edge, keep in zip(edges, used, strict=True) if keep]
    poses = _optimised(chained(len(points_m), kept, reference), kept, reference)
    agreeing = [edge for edge in edges if edge.agrees]
    loop_error_m = tuple(_loop_error_m(points_m, edge, agreeing) for edge in edges)
    return PoseGraph(tuple(poses), loop_error_m, tuple(used))


def chained(nodes: int, edges: Sequence[PoseEdge], reference: int = 0) -> list[FloatArray]:
    """Return T_reference_node along the tree of edges with the most pairs; NaN for unreachable nodes."""
    poses: list[FloatArray | None] = [None] * nodes
    poses[reference] = np.eye(4)
    while True:
        bridges = [edge for edge in edges if (poses[edge.source] is None) != (poses[edge.target] is None)]
        if not bridges:
            return [np.full((4, 4), np.nan) if pose is None else pose for pose in poses]
        edge = max(bridges, key=lambda bridge: bridge.pairs)
        known = poses[edge.target]
        if known is not None:
            poses[edge.source] = known @ edge.T_target_source
        elif (other := poses[edge.source]) is not None:
            poses[edge.target] = other @ inverse(edge.T_target_source)


def _consistent(points_m: Sequence[FloatArray], edges: Sequence[PoseEdge]) -> list[bool]:
    """Reject the worst-fitting edge that no loop confirms until all loops close; returns which edges stay."""
    used = [edge.agrees for edge in edges]
    while True:
        left = [edge for edge, keep in zip(edges, used, strict=True) if keep]
        suspects = [
            place
            for place, edge in enumerate(edges)
            if used[place] and _loop_error_m(points_m, edge, left) > LOOP_TOLERANCE_M
        ]
        if not suspects:
            return used
        used[max(suspects, key=lambda place: edges[place].misfit_m)] = False


def _loop_error_m(points_m: Sequence[FloatArray], edge: PoseEdge, edges: Sequence[PoseEdge]) -> float:
    """Return the point error between an edge and the path that agrees with it best; NaN without a path."""
    errors = [
        point_error_m(T, edge.T_target_source, points_m[edge.source])
        for T in _ways(edge.source, edge.target, [other for other in edges if other is not edge])
    ]
    return min(errors, default=float("nan"))


def _ways(start: int, end: int, edges: Sequence[PoseEdge]) -> Iterator[FloatArray]:
    """Yield T_end_start along every path without a repeated node."""
    if start == end:
        yield np.eye(4)
        return
    for edge in edges:
        if start not in (edge.source, edge.target):
            continue
        ahead = edge.target if edge.source == start else edge.source
        step = edge.T_target_source if edge.source == start else inverse(edge.T_target_source)
        rest = [other for other in edges if start not in (other.source, other.target)]
        for T in _ways(ahead, end, rest):
            yield T @ step


def _optimised(start: Sequence[FloatArray], edges: Sequence[PoseEdge], reference: int) -> list[FloatArray]:
    """Run Open3D's Levenberg-Marquardt on the nodes that have a start pose, with the reference fixed."""
    reached = [node for node, pose in enumerate(start) if np.isfinite(pose).all()]
    if len(edges) < len(reached):
        return list(start)  # the edges form a tree, so nothing has to be reconciled
    place = {node: index for index, node in enumerate(reached)}
    o3d_registration = o3d.pipelines.registration
    graph = o3d_registration.PoseGraph()
    for node in reached:
        graph.nodes.append(o3d_registration.PoseGraphNode(start[node]))
    for edge in edges:
        if edge.source in place and edge.target in place:
            graph.edges.append(
                o3d_registration.PoseGraphEdge(
                    place[edge.source], place[edge.target], edge.T_target_source, edge.information, False
                )
            )
    o3d_registration.global_optimization(
        graph,
        o3d_registration.GlobalOptimizationLevenbergMarquardt(),
        o3d_registration.GlobalOptimizationConvergenceCriteria(),
        o3d_registration.GlobalOptimizationOption(INFORMATION_GATE_M, 0.25, 1.0, place[reference]),
    )
    poses = list(start)
    for node in reached:
        poses[node] = np.array(graph.nodes[place[node]].pose)
    return poses
