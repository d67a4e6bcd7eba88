"""Choice of the pairs of nodes that are registered: enough for a tree and loops, not all."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

from pipeline.placement.loops import Groups
from pipeline.placement.samples import NodeSample, shared_view

SHARED_VIEW = 0.25
"""Least share of a node's points in another's image for registering the two."""
GIVEN_PAIRS = 4
"""Most earlier nodes to which a node with a given pose is registered: those with the largest common view."""
SURE_PAIRS = 3
"""Sure registrations of a node without a pose after which no more are looked for: one for the tree and two
that close loops."""
LOOP_TRIES = 6
"""Most registrations of a node without a pose that are tried for the sake of loops alone."""

Pair = tuple[int, int]
"""A later node and an earlier one: source and target."""
Candidates = Callable[[Sequence[NodeSample]], Sequence[Pair]]
"""Function that orders all pairs of nodes whose common view is unknown, the likeliest to overlap first."""


def neighbours_first(nodes: Sequence[NodeSample]) -> list[Pair]:
    """Order the pairs by the distance of their nodes in the rig: images taken in a row overlap most."""
    count = len(nodes)
    return [(near + apart, near) for apart in range(1, count) for near in range(count - apart)]


def given_pairs(nodes: Sequence[NodeSample], known: Sequence[bool]) -> tuple[list[Pair], list[Pair]]:
    """Return pairs of nodes with known poses: each node with its best earlier partner, and those for loops.

    The partner is the earlier node in whose image most of the node's points are; up to ``GIVEN_PAIRS`` - 1
    others follow, if they see at least ``SHARED_VIEW`` of the node.
    """
    partners, others = [], []
    for index in range(1, len(nodes)):
        earlier = [k for k in range(index) if known[index] and known[k]]
        shares = {k: shared_view(nodes[index], nodes[k]) for k in earlier}
        if not shares:
            continue
        partner, *more = sorted(shares, key=lambda k: (-shares[k], k))[:GIVEN_PAIRS]
        partners.append((index, partner))
        others += [(index, k) for k in sorted(more) if shares[k] >= SHARED_VIEW]
    return partners, others


class UnknownPairs:
    """The next pair to try among nodes of which some have no pose."""

    def __init__(self, candidates: Sequence[Pair], known: Sequence[bool]) -> None:
        """Begin with all candidates that are not both known, the likeliest first."""
        self._left = [(one, other) for one, other in candidates if not (known[one] and known[other])]
        self._tries = [0] * len(known)

    def next(self, links: Sequence[Pair], nodes: int) -> tuple[Pair, bool] | None:
        """Return the next pair, and whether it may join two groups of nodes; None if there are enough.

        Args:
            links: pairs of nodes whose registrations are sure and agree with each other.
            nodes: number of nodes.
        """
        groups = Groups(nodes, links)
        sure = [sum(node in link for link in links) for node in range(nodes)]
        joins = next((pair for pair in self._left if groups.of(pair[0]) != groups.of(pair[1])), None)
        pair = joins or next(self._for_loops(sure), None)
        if pair is None:
            return None
        self._left.remove(pair)
        if joins is None:
            for node in pair:
                self._tries[node] += 1
        return pair, joins is not None

    def _for_loops(self, sure: Sequence[int]) -> Iterator[Pair]:
        """Yield the pairs in which a node has too few sure registrations and tries left."""
        for pair in self._left:
            if any(sure[node] < SURE_PAIRS and self._tries[node] < LOOP_TRIES for node in pair):
                yield pair
