"""Pose graph of a rig: loops reveal wrong registrations, least squares reconciles the others."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_matrix, csc_matrix, diags
from scipy.sparse.linalg import splu

from pipeline.kernels.geometry import rigid, rotation_exp
from pipeline.registration.graph.edges import PoseEdge, adjoint, small_motion
from pipeline.registration.graph.loops import LOOP_LIMIT, Groups, Loops, best_loops
from pipeline.registration.metrics import point_error_m
from pipeline.types import FloatArray, IntArray

MAX_STEPS = 50
STILL = 1e-9
"""The optimisation stops when no node turns or moves more than this, rad and m."""
FIRST_DAMPING = 1e-6
"""Damping after the first step that raises the sum."""
ROUNDING = 1e-9
"""Rise of the sum, as a share of it and absolute, that counts as rounding."""


@dataclass(frozen=True, slots=True)
class PoseGraph:
    """Solution of a pose graph, with edges in the given order."""

    T_reference_node: tuple[FloatArray, ...]
    """(4, 4) pose of every node in the reference's frame; NaN for nodes that no used edge reaches."""
    loop_error_m: tuple[float, ...]
    """Point error between each edge and the other way between its nodes: along the spanning tree or, for an
    edge of the tree, around the loop that closes best; NaN without a loop."""
    used: tuple[bool, ...]
    """False for edges that contradict the loops, and for those with ``agrees`` False."""


def solve_pose_graph(
    points_m: Sequence[FloatArray], edges: Sequence[PoseEdge], reference: int = 0
) -> PoseGraph:
    """Compute the poses that agree best with the edges, after rejecting edges that contradict the loops.

    Edges that contradict the tree of the strongest evidence are rejected first; then, one by one, the edge
    that is farthest from the least-squares poses while it is outside its error, if another way remains.

    Args:
        points_m: (N, 3) points of every node, in its own frame, at which errors are measured.
        edges: the registrations, at most one per pair of nodes.
        reference: node whose pose is the identity.
    """
    nodes = len(points_m)
    loops = best_loops(nodes, edges)
    used = [edge.agrees and agrees for edge, agrees in zip(edges, loops.agreeing(len(edges)), strict=True)]
    T_root_node = loops.T_root_node
    while True:
        kept = [place for place, use in enumerate(used) if use]
        T_root_node, distance = optimised(T_root_node, [edges[place] for place in kept])
        worst = _worst_in_a_loop(nodes, edges, kept, distance)
        if worst is None:
            break
        used[worst] = False
    groups = Groups(nodes, [(edges[place].source, edges[place].target) for place in kept])
    T_reference_root = np.linalg.inv(T_root_node[reference])
    reached = [groups.of(node) == groups.of(reference) for node in range(nodes)]
    return PoseGraph(
        tuple(
            T_reference_root @ T if there else np.full((4, 4), np.nan)
            for T, there in zip(T_root_node, reached, strict=True)
        ),
        _loop_errors_m(points_m, edges, loops),
        tuple(used),
    )


def _worst_in_a_loop(
    nodes: int, edges: Sequence[PoseEdge], kept: Sequence[int], distance: FloatArray
) -> int | None:
    """Return the edge that is farthest from the poses and outside its error, if it is not the only way."""
    for row in np.argsort(-distance):
        if distance[row] <= LOOP_LIMIT:
            return None
        others = [(edges[k].source, edges[k].target) for k in kept if k != kept[row]]
        groups, edge = Groups(nodes, others), edges[kept[row]]
        if groups.of(edge.source) == groups.of(edge.target):
            return kept[row]
    return None


def _loop_errors_m(
    points_m: Sequence[FloatArray], edges: Sequence[PoseEdge], loops: Loops
) -> tuple[float, ...]:
    """Return ``PoseGraph.loop_error_m``."""
    errors_m = [float("nan")] * len(edges)
    T = loops.T_root_node
    confirming = np.array([edges[place].agrees for place in loops.closing], bool)
    distance = np.where(confirming, loops.distance, np.inf)
    rows = {place: row for row, place in enumerate(loops.closing)}
    for place in (*loops.tree, *loops.closing):
        edge = edges[place]
        if place in rows:
            T_target_source = np.linalg.inv(T[edge.target]) @ T[edge.source]
        else:
            through = np.flatnonzero(loops.passes[:, place] & confirming)
            if not len(through):
                continue
            T_target_source = _around(edges, loops, place, int(through[np.argmin(distance[through])]))
        errors_m[place] = point_error_m(T_target_source, edge.T_target_source, points_m[edge.source])
    return tuple(errors_m)


def _around(edges: Sequence[PoseEdge], loops: Loops, place: int, row: int) -> FloatArray:
    """Return T_target_source of a tree's edge by the way around one of its loops."""
    edge, closing = edges[place], edges[loops.closing[row]]
    T, others = loops.T_root_node, [(edges[k].source, edges[k].target) for k in loops.tree if k != place]
    groups = Groups(len(T), others)
    with_source = groups.of(closing.source) == groups.of(edge.source)
    motion = loops.motion[row] if with_source else np.linalg.inv(loops.motion[row])
    return np.linalg.inv(T[edge.target]) @ motion @ T[edge.source]


def optimised(start: FloatArray, edges: Sequence[PoseEdge]) -> tuple[FloatArray, FloatArray]:
    """Minimise the sum of the edges' squared Mahalanobis distances over the poses (Levenberg-Marquardt).

    A step is damped only after one that raises the sum: along a bare wall, where edges hardly hold a motion,
    full steps would diverge.

    The first node of each connected group keeps its pose. The distance of an edge X between poses A of its
    source and B of its target is that of X^-1 B^-1 A from the identity (Choi, Zhou, Koltun 2015, eq. 3).

    Args:
        start: (N, 4, 4) start poses in one frame per group; poses along a spanning tree are near enough.
        edges: the registrations.

    Returns:
        (N, 4, 4) poses, and (E,) squared Mahalanobis distances of the edges, with the slack of loops.
    """
    T = np.array(start)
    if not edges:
        return T, np.empty(0)
    sources, targets = (np.array([getattr(edge, end) for edge in edges]) for end in ("source", "target"))
    T_source_target = np.linalg.inv([edge.T_target_source for edge in edges])
    information = np.array([edge.information for edge in edges])
    groups = Groups(len(T), zip(sources.tolist(), targets.tolist(), strict=True))
    free = np.array([node for node in range(len(T)) if groups.of(node) != node], int)
    total, damping = _total(T, T_source_target, information, sources, targets), 0.0
    for _ in range(MAX_STEPS):
        step = _step(T, T_source_target, information, sources, targets, free, damping)
        moved = T.copy()
        for node, motion in zip(free, step, strict=True):
            moved[node] = T[node] @ rigid(rotation_exp(motion[:3]), motion[3:])
        after = _total(moved, T_source_target, information, sources, targets)
        still = np.abs(step).max() <= STILL
        if not still and not after <= (1.0 + ROUNDING) * total + ROUNDING:
            damping = max(FIRST_DAMPING, 10.0 * damping)
            continue
        T, total = moved, after
        damping = 0.1 * damping if damping > FIRST_DAMPING else 0.0
        if still:
            break
    error = small_motion(T_source_target @ np.linalg.inv(T[targets]) @ T[sources])
    covariance = np.array([edge.loop_covariance for edge in edges])
    return T, np.einsum("ei,ei->e", error, np.linalg.solve(covariance, error[..., None])[..., 0])


def _total(
    T: FloatArray, T_source_target: FloatArray, information: FloatArray, sources: IntArray, targets: IntArray
) -> float:
    """Return the sum of the edges' squared Mahalanobis distances."""
    error = small_motion(T_source_target @ np.linalg.inv(T[targets]) @ T[sources])
    return float(np.einsum("ei,eij,ej->", error, information, error))


def _step(
    T: FloatArray,
    T_source_target: FloatArray,
    information: FloatArray,
    sources: IntArray,
    targets: IntArray,
    free: IntArray,
    damping: float,
) -> FloatArray:
    """Return the (F, 6) motions of the free nodes, each in its own frame, of one step.

    The diagonal of the normal matrix is multiplied by 1 + ``damping``.
    """
    normal, gradient = _normal_equations(T, T_source_target, information, sources, targets, free)
    normal += diags(damping * normal.diagonal(), format="csc")
    solved: FloatArray = splu(normal).solve(-gradient)
    return solved.reshape(-1, 6)


def motion_covariances(
    T_reference_node: Sequence[FloatArray], edges: Sequence[PoseEdge], reference: int
) -> tuple[FloatArray, ...]:
    """Compute the covariance of every node's pose, by the information of the edges that gave it.

    Args:
        T_reference_node: (4, 4) solved pose of every node; NaN for nodes without one.
        edges: the registrations that were used.
        reference: node whose pose is the identity.

    Returns:
        (6, 6) covariance of each node's small motion (turn in rad about the reference's origin, then shift in
            m; both along the reference's axes): 0 for the reference, NaN for a node without a pose and for
            one that no edges join to the reference.
    """
    posed = [bool(np.isfinite(T).all()) for T in T_reference_node]
    joined = [edge for edge in edges if posed[edge.source] and posed[edge.target]]
    groups = Groups(len(posed), [(edge.source, edge.target) for edge in joined])
    reached = np.array(
        [there and groups.of(node) == groups.of(reference) for node, there in enumerate(posed)]
    )
    T = np.array([T if there else np.eye(4) for T, there in zip(T_reference_node, reached, strict=True)])
    found = [np.zeros((6, 6)) if there else np.full((6, 6), np.nan) for there in reached]
    held = [edge for edge in joined if reached[edge.source]]
    free = np.array([node for node in np.flatnonzero(reached) if node != reference], int)
    if not held or not len(free):
        return tuple(found)
    sources, targets = (np.array([getattr(edge, end) for edge in held]) for end in ("source", "target"))
    T_source_target = np.linalg.inv([edge.T_target_source for edge in held])
    information = np.array(
        [edge.information if edge.weak_information is None else edge.weak_information for edge in held]
    )
    normal, _ = _normal_equations(T, T_source_target, information, sources, targets, free)
    covariance = np.linalg.inv(normal.toarray())
    for row, node in enumerate(free):
        own, to_reference = covariance[6 * row : 6 * row + 6, 6 * row : 6 * row + 6], adjoint(T[node])
        found[node] = to_reference @ own @ to_reference.T
    return tuple(found)


def _normal_equations(
    T: FloatArray,
    T_source_target: FloatArray,
    information: FloatArray,
    sources: IntArray,
    targets: IntArray,
    free: IntArray,
) -> tuple[csc_matrix, FloatArray]:
    """Return the (6 F, 6 F) normal matrix and the (6 F,) gradient over the free nodes' own motions."""
    T_target_source = np.linalg.inv(T[targets]) @ T[sources]
    error = small_motion(T_source_target @ T_target_source)
    by_target = -adjoint(np.linalg.inv(T_target_source))  # the source's own motion enters as it is
    place = np.full(len(T), -1)
    place[free] = np.arange(len(free))
    ends = (sources, np.broadcast_to(np.eye(6), by_target.shape)), (targets, by_target)
    gradient = np.zeros((len(free), 6))
    blocks, rows, columns = [], [], []
    for one, J_one in ends:
        weighed = np.swapaxes(J_one, 1, 2) @ information
        at_one = place[one] >= 0
        np.add.at(gradient, place[one][at_one], np.einsum("eij,ej->ei", weighed, error)[at_one])
        for other, J_other in ends:
            both = at_one & (place[other] >= 0)
            blocks.append((weighed @ J_other)[both])
            rows.append(place[one][both])
            columns.append(place[other][both])
    block, row, column = (np.concatenate(parts) for parts in (blocks, rows, columns))
    axis = np.arange(6)
    row = np.broadcast_to(6 * row[:, None, None] + axis[:, None], block.shape)
    column = np.broadcast_to(6 * column[:, None, None] + axis, block.shape)
    size = 6 * len(free)
    normal = coo_matrix((block.ravel(), (row.ravel(), column.ravel())), shape=(size, size)).tocsc()
    return normal, gradient.ravel()
