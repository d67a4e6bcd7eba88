"""Choice of the pairs of nodes that are registered: enough for a tree and loops, not all."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

from pipeline.placement.samples import NodeSample, shared_view
from pipeline.registration.graph.loops import Groups
from pipeline.types import FloatArray

SHARED_VIEW = 0.25
"""Least share of a node's points in another's image for registering the two."""
GIVEN_PAIRS = 4
"""Most earlier nodes to which a node with a pose is registered: those with the largest common view."""
COLOUR_TRIES = 40
"""Most pairs of a node that are tried by colour, to join it to others."""
LONE_TRIES, GROUP_TRIES = 12, 2
"""Most pairs of a node that are tried by surfaces: if colour joined it to no other node, and if it did."""
BRIDGE_TRIES = 2
"""Most further pairs that are tried where a single registration joins two groups."""

Pair = tuple[int, int]
"""A later node and an earlier one: source and target."""


def likeliest_first(known: Sequence[bool], likeness: Callable[[int, int], float]) -> list[Pair]:
    """Return the pairs of nodes with at most one known pose, the most alike first.

    Of pairs that are equally alike, those closer in the rig's order come first: images taken in a row overlap
    most.

    Args:
        known: whether each node's pose is known.
        likeness: returns how much alike two nodes' images are.
    """
    count = len(known)
    pairs = [(near + apart, near) for apart in range(1, count) for near in range(count - apart)]
    unknown = [pair for pair in pairs if not (known[pair[0]] and known[pair[1]])]
    return sorted(unknown, key=lambda pair: -likeness(*pair))


def given_pairs(
    nodes: Sequence[NodeSample], poses: Sequence[FloatArray], group: Sequence[int | None]
) -> tuple[list[Pair], list[Pair]]:
    """Return pairs of nodes with poses: each node with its best earlier partner, and those for loops.

    The partner is the earlier node in whose image most of the node's points are; up to ``GIVEN_PAIRS`` - 1
    others follow, if they see at least ``SHARED_VIEW`` of the node.

    Args:
        nodes: the nodes.
        poses: (4, 4) pose T_group_camera of each.
        group: number of the frame in which each pose is; None without a pose.
    """
    partners, others = [], []
    for index in range(1, len(nodes)):
        shares = {
            k: shared_view(nodes[index], nodes[k], poses[index], poses[k])
            for k in range(index)
            if group[index] is not None and group[k] == group[index]
        }
        if not shares:
            continue
        partner, *more = sorted(shares, key=lambda k: (-shares[k], k))[:GIVEN_PAIRS]
        partners.append((index, partner))
        others += [(index, k) for k in sorted(more) if shares[k] >= SHARED_VIEW]
    return partners, others


class JoiningPairs:
    """Pairs that may join two groups of nodes, in a given order.

    A pair uses up one try of its node in the smaller group, or of equal groups that with more tries left. It
    is skipped if this node has none.
    """

    def __init__(self, candidates: Sequence[Pair], tries: Sequence[int]) -> None:
        """Begin with all candidates.

        Args:
            candidates: pairs, the likeliest first.
            tries: most pairs of each node.
        """
        self._left, self._tries = list(candidates), list(tries)

    def next(self, links: Sequence[Pair]) -> Pair | None:
        """Return the next pair whose nodes are in different groups, and use up a try; None if there is none.

        Args:
            links: pairs of nodes whose poses relative to each other are known.
        """
        groups = Groups(len(self._tries), links)
        sizes = {node: len(members) for members in groups.sets() for node in members}
        for pair in self._left:
            node = min(pair, key=lambda node: (sizes[node], -self._tries[node]))
            if groups.of(pair[0]) != groups.of(pair[1]) and self._tries[node] > 0:
                self._tries[node] -= 1
                self._left.remove(pair)
                return pair
        return None


def lone_tries(nodes: int, links: Sequence[Pair]) -> list[int]:
    """Return the most pairs of each node that are tried by surfaces, after all tries by colour."""
    linked = {node for link in links for node in link}
    return [GROUP_TRIES if node in linked else LONE_TRIES for node in range(nodes)]


def across_bridges(candidates: Sequence[Pair], links: Sequence[Pair], nodes: int) -> Iterator[Pair]:
    """Yield up to ``BRIDGE_TRIES`` pairs for each link that alone joins two parts, the likeliest first.

    Args:
        candidates: pairs that were not tried, the likeliest first.
        links: pairs of nodes whose poses relative to each other are known.
        nodes: number of nodes.
    """
    yielded: set[Pair] = set()
    whole = Groups(nodes, links)
    for bridge in links:
        parts = Groups(nodes, [link for link in links if link != bridge])
        if parts.of(bridge[0]) == parts.of(bridge[1]):
            continue
        across = [
            pair
            for pair in candidates
            if whole.of(pair[0]) == whole.of(pair[1]) == whole.of(bridge[0])
            and parts.of(pair[0]) != parts.of(pair[1])
        ]
        for pair in across[:BRIDGE_TRIES]:
            if pair not in yielded:
                yielded.add(pair)
                yield pair
