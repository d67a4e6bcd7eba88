"""Loops of a pose graph: a spanning tree with which most evidence agrees, and the edges that contradict it.

Every edge outside a spanning tree closes one loop, with the tree's path between its nodes. So a graph of E
edges has E - N + 1 loops to test instead of the exponentially many closed walks, and the others follow.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from pipeline.kernels.geometry import inverse
from pipeline.registration.graph.edges import PoseEdge, adjoint, small_motion
from pipeline.types import BoolArray, FloatArray, IntArray

LOOP_LIMIT = 25.0
"""Largest squared Mahalanobis distance of a loop of right edges (chi-square with six degrees of freedom: a
chance of 3 in 10,000). For three edges whose pairs hold every motion it is an error of 5 cm."""
_GAIN = 1e-9
"""Gain of evidence that counts as rounding."""


@dataclass(frozen=True, slots=True)
class Loops:
    """A spanning forest of some edges, and the loop of each other edge; edges by their place in the list."""

    tree: tuple[int, ...]
    """Edges of the forest."""
    T_root_node: FloatArray
    """(N, 4, 4) pose of every node along the tree, in the frame of the first node of its group."""
    root: IntArray
    """(N,) first node of each node's group."""
    closing: tuple[int, ...]
    """Edges outside the forest with both nodes in one group: one loop each."""
    motion: FloatArray
    """(L, 4, 4) motion around each loop, in the root's frame; the identity if it closes."""
    distance: FloatArray
    """(L,) squared Mahalanobis distance of the motion from the identity."""
    passes: BoolArray
    """(L, E) whether the path of each loop through the tree has each edge."""

    @property
    def close(self) -> BoolArray:
        """(L,) True for loops that close within their error."""
        return self.distance <= LOOP_LIMIT

    def evidence(self, strengths: FloatArray) -> float:
        """Return the sum of the strengths of the tree's edges and of those that agree with it."""
        agreeing = np.array(self.closing, int)[self.close]
        return float(strengths[list(self.tree)].sum() + strengths[agreeing].sum())

    def agreeing(self, edges: int) -> list[bool]:
        """Return for each of ``edges`` edges whether it is in the tree or agrees with it."""
        kept = {*self.tree, *np.array(self.closing, int)[self.close].tolist()}
        return [place in kept for place in range(edges)]


def best_loops(nodes: int, edges: Sequence[PoseEdge]) -> Loops:
    """Find a spanning forest with which the strongest evidence agrees.

    The start is the tree of the strongest edges. Each edge of the tree divides its group into two parts. If
    the edges between these parts that contradict it weigh more than it and those that agree with it, each of
    them is tried in its place, and taken if the evidence that agrees with the tree increases. So no single
    exchange improves the result: of the edges between two such parts, those that stay weigh at least as much
    as any others that agree with one another. One wrong edge is found if two right edges join the same parts,
    two wrong ones that agree with each other if stronger right ones do; an edge without a loop stays.

    Args:
        nodes: number of nodes.
        edges: the registrations; those that do not agree are left out of the tree and of the evidence.
    """
    strengths = np.array([edge.strength if edge.agrees else 0.0 for edge in edges])
    strongest = sorted(
        (k for k, edge in enumerate(edges) if edge.agrees),
        key=lambda k: (-strengths[k], edges[k].source, edges[k].target),
    )
    best = loops_of(nodes, edges, spanning_forest(nodes, edges, strongest))
    while (better := next(_better(nodes, edges, best, strengths), None)) is not None:
        best = better
    return best


def _better(nodes: int, edges: Sequence[PoseEdge], best: Loops, strengths: FloatArray) -> Iterator[Loops]:
    """Yield forests with one edge exchanged with which more evidence agrees."""
    closing, evidence = np.array(best.closing, int), best.evidence(strengths)
    by_loop = strengths[closing][:, None] * best.passes
    against = by_loop[~best.close].sum(axis=0) - by_loop[best.close].sum(axis=0) - strengths
    for out in sorted(best.tree, key=lambda k: -against[k]):
        if against[out] <= _GAIN:
            return
        others = closing[~best.close & best.passes[:, out]]
        for instead in sorted(others[strengths[others] > 0.0], key=lambda k: -strengths[k]):
            tree = [int(instead) if k == out else k for k in best.tree]
            found = loops_of(nodes, edges, tree)
            if found.evidence(strengths) > evidence + _GAIN:
                yield found


def spanning_forest(nodes: int, edges: Sequence[PoseEdge], order: Iterable[int]) -> list[int]:
    """Return the edges that join two groups when they are taken in the given order (Kruskal 1956)."""
    groups = Groups(nodes)
    return [place for place in order if groups.join(edges[place].source, edges[place].target)]


class Groups:
    """Connected groups of nodes that grow by links."""

    def __init__(self, nodes: int, links: Iterable[tuple[int, int]] = ()) -> None:
        """Begin with single nodes, then add the links."""
        self._above = list(range(nodes))
        for one, other in links:
            self.join(one, other)

    def of(self, node: int) -> int:
        """Return the number of a node's group, which is that of its first node."""
        while self._above[node] != node:
            self._above[node] = self._above[self._above[node]]
            node = self._above[node]
        return node

    def join(self, one: int, other: int) -> bool:
        """Join the groups of two nodes; returns False if they were one."""
        first, second = sorted((self.of(one), self.of(other)))
        self._above[second] = first
        return first != second

    def sets(self) -> list[set[int]]:
        """Return the groups, ordered by their first nodes."""
        found: dict[int, set[int]] = {}
        for node in range(len(self._above)):
            found.setdefault(self.of(node), set()).add(node)
        return list(found.values())


def loops_of(nodes: int, edges: Sequence[PoseEdge], tree: Sequence[int]) -> Loops:
    """Return the poses along a forest, and the loop that each other edge closes with it.

    The covariance of a loop is the sum of those of its edges, each moved into one frame by the adjoint of its
    pose (first order).
    """
    walk = _Walk(nodes, edges, tree)
    inside = set(tree)
    closing = [
        place
        for place, edge in enumerate(edges)
        if place not in inside and walk.root[edge.source] == walk.root[edge.target]
    ]
    passes = np.zeros((len(closing), len(edges)), bool)
    tops = np.empty(len(closing), int)
    for row, place in enumerate(closing):
        tops[row], path = walk.path(edges[place].source, edges[place].target)
        passes[row, path] = True
    T = walk.T_root_node
    sources = np.array([edges[place].source for place in closing], int)
    targets = np.array([edges[place].target for place in closing], int)
    X = np.array([edges[place].T_target_source for place in closing]).reshape(-1, 4, 4)
    own = np.array([edges[place].loop_covariance for place in closing]).reshape(-1, 6, 6)
    T_source_root = np.linalg.inv(T[sources])
    error = small_motion(np.linalg.inv(X) @ np.linalg.inv(T[targets]) @ T[sources])
    change = adjoint(T_source_root)
    of_path = walk.covariance[sources] + walk.covariance[targets] - 2.0 * walk.covariance[tops]
    covariance = own + change @ of_path @ np.swapaxes(change, 1, 2)
    distance = np.einsum("li,li->l", error, np.linalg.solve(covariance, error[..., None])[..., 0])
    return Loops(tuple(tree), T, walk.root, tuple(closing), T[targets] @ X @ T_source_root, distance, passes)


class _Walk:
    """Poses of all nodes along a forest, from the first node of each group."""

    def __init__(self, nodes: int, edges: Sequence[PoseEdge], tree: Sequence[int]) -> None:
        """Walk each group from its first node."""
        beside: list[list[int]] = [[] for _ in range(nodes)]
        for place in tree:
            beside[edges[place].source].append(place)
            beside[edges[place].target].append(place)
        self.root = np.full(nodes, -1)
        self.T_root_node = np.tile(np.eye(4), (nodes, 1, 1))
        self.covariance = np.zeros((nodes, 6, 6))
        self._above, self._by, self._depth = ([0] * nodes for _ in range(3))
        for first in range(nodes):
            if self.root[first] < 0:
                self._group(first, edges, beside)

    def _group(self, first: int, edges: Sequence[PoseEdge], beside: Sequence[Sequence[int]]) -> None:
        self.root[first] = first
        front = [first]
        for node in front:
            for place in beside[node]:
                edge = edges[place]
                ahead = edge.target if edge.source == node else edge.source
                if self.root[ahead] >= 0:
                    continue
                step = edge.T_target_source if edge.target == node else inverse(edge.T_target_source)
                self.root[ahead] = first
                self.T_root_node[ahead] = self.T_root_node[node] @ step
                to_root = adjoint(self.T_root_node[edge.source])
                own = to_root @ edge.loop_covariance @ to_root.T
                self.covariance[ahead] = self.covariance[node] + own
                self._above[ahead], self._by[ahead] = node, place
                self._depth[ahead] = self._depth[node] + 1
                front.append(ahead)

    def path(self, one: int, other: int) -> tuple[int, list[int]]:
        """Return the node of the path between two nodes that is nearest to the root, and the path's edges."""
        path = []
        while one != other:
            if self._depth[one] < self._depth[other]:
                one, other = other, one
            path.append(self._by[one])
            one = self._above[one]
        return one, path
