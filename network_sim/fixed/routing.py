"""Routes to the sink: shortest paths by expected transmissions (ETX), and success rates of links."""

from __future__ import annotations

import heapq
import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import gammaincinv

from network_sim.config import ANY_DISTANCE, STARS, NetworkConfig
from network_sim.radio.places import Places
from network_sim.radio.propagation import Radio, modulation

_QUANTILES = 64
"""Quantiles of the fading over which the success of a frame is averaged."""


@dataclass(frozen=True, slots=True)
class Routes:
    """A tree of shortest paths to the sink."""

    sink: int
    parents: tuple[int, ...]
    """The next node towards the sink; -1 for the sink and for nodes without a route."""
    cost: tuple[float, ...]
    """Expected transmissions to the sink; infinite without a route."""

    def hops(self, node: int) -> int:
        """Return the number of links from a node to the sink; -1 without a route."""
        if math.isinf(self.cost[node]):
            return -1
        count = 0
        while node != self.sink:
            node, count = self.parents[node], count + 1
        return count

    def next_hop(self, at: int, destination: int) -> int:
        """Return the next node of a packet, up the tree to the sink or down from it; -1 without a route."""
        if destination == self.sink:
            return self.parents[at]
        node = destination
        while node >= 0 and self.parents[node] != at:
            node = self.parents[node]
        return node

    @property
    def unreachable(self) -> tuple[int, ...]:
        """Nodes without a route to the sink."""
        return tuple(node for node, cost in enumerate(self.cost) if math.isinf(cost))


def shortest_paths(success: NDArray, sink: int) -> Routes:
    """Find the cheapest route of every node (Dijkstra); a link costs its expected transmissions (ETX).

    Args:
        success: (N, N) probability that a frame from row to column arrives; 0 means no link. Booleans give
            the fewest hops.
        sink: destination of all routes.

    Returns:
        The routes. Of equally cheap ones, that over the next node with the cheapest route, then the one with
        the fewest hops, then the one with the lowest number.
    """
    both = np.asarray(success, float) * np.asarray(success, float).T
    with np.errstate(divide="ignore"):
        links = (1.0 / both).tolist()
    count = len(links)
    parents, cost = [-1] * count, [math.inf] * count
    cost[sink] = 0.0
    heap, settled = [(0.0, 0, sink)], [False] * count
    while heap:
        _, hops, node = heapq.heappop(heap)
        if settled[node]:
            continue
        settled[node] = True
        for other, link in enumerate(links[node]):
            if not settled[other] and cost[node] + link < cost[other]:
                cost[other], parents[other] = cost[node] + link, node
                heapq.heappush(heap, (cost[other], hops + 1, other))
    return Routes(sink, tuple(parents), tuple(cost))


def link_success(config: NetworkConfig, radio: Radio, places: Places) -> NDArray[np.float64]:
    """Compute the probability that an undisturbed data frame arrives, for each link.

    Args:
        config: Size and medium access of the packets. Serial lines and recorded links connect all nodes; in a
            star every link has the sink at one end.
        radio: Powers, threshold and noise.
        places: Positions of the nodes.

    Returns:
        (N, N) probabilities, averaged over fading; 0 where the mean power is below the receive threshold.
    """
    count = places.count
    if config.mac.kind in ANY_DISTANCE:
        success = 1.0 - np.eye(count)
        return _star(success) if config.mac.kind in STARS else success
    success = np.zeros((count, count))
    for a in range(count):
        for b in range(a):
            power_w = radio.between_w(places, a, b, 0)
            if power_w >= radio.rx_threshold_w:
                success[a, b] = success[b, a] = _frame_success(config, radio, power_w)
    return _star(success) if config.mac.kind in STARS else success


def _star(success: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the links (N, N) of the sink, which is the last node, without those between other nodes."""
    only = np.zeros_like(success)
    only[-1], only[:, -1] = success[-1], success[:, -1]
    return only


def _frame_success(config: NetworkConfig, radio: Radio, power_w: float) -> float:
    if config.mac.kind == "ideal":
        return 1.0
    shape = config.radio.nakagami_m
    gains = np.ones(1)
    if shape is not None:
        gains = gammaincinv(shape, (np.arange(_QUANTILES) + 0.5) / _QUANTILES) / shape
    received_w = [gain * power_w for gain in gains.tolist() if gain * power_w >= radio.rx_threshold_w]
    if radio.noise_w is None:
        return len(received_w) / len(gains)
    size_bytes = config.nodes.payload_bytes
    kind = modulation(config.mac)
    good = sum(1.0 - radio.error_rate(one_w / radio.noise_w, size_bytes, kind) for one_w in received_w)
    return good / len(gains)
