"""Positions of the nodes, and layouts of fixed nodes."""

from __future__ import annotations

from typing import Protocol

import numpy as np

from network_sim.config import NodesConfig


class Places(Protocol):
    """Positions of all nodes at any time."""

    static: bool
    """True if no node moves, so that distances may be cached."""

    @property
    def count(self) -> int:
        """Number of nodes, sinks and access points together."""

    def position_m(self, node: int, now_ns: int) -> tuple[float, float]:
        """Return a node's position in metres east and north."""

    def distance_m(self, a: int, b: int, now_ns: int) -> float:
        """Return the distance of two nodes."""


class FixedPlaces:
    """Positions of nodes that do not move."""

    static = True

    def __init__(self, positions_m: np.ndarray) -> None:
        """Compute all distances from the positions (N, 2)."""
        self.positions_m = np.asarray(positions_m, dtype=float)
        between_m = self.positions_m[:, None] - self.positions_m[None]
        self._distances_m: list[list[float]] = np.hypot(between_m[..., 0], between_m[..., 1]).tolist()

    @property
    def count(self) -> int:
        """Number of nodes and sink together."""
        return len(self._distances_m)

    def position_m(self, node: int, now_ns: int) -> tuple[float, float]:
        """Return a node's position, which is the same at any time."""
        x_m, y_m = self.positions_m[node].tolist()
        return x_m, y_m

    def distance_m(self, a: int, b: int, now_ns: int) -> float:
        """Return the distance of two nodes, which is the same at any time."""
        return self._distances_m[a][b]


def place_nodes(config: NodesConfig, rng: np.random.Generator) -> FixedPlaces:
    """Place the nodes, then the sink: as given in ``config.places_m``, or by ``config.layout``.

    Args:
        config: Count, and positions or layout and spacing.
        rng: Random generator of the random layout; the other layouts do not use it.

    Returns:
        Positions of ``config.count`` + 1 nodes; the sink is the last and is at the origin of a layout.
    """
    if config.places_m:
        return FixedPlaces(np.reshape(config.places_m, (-1, 2)))
    count = config.count
    index = np.arange(count)
    if config.layout == "star":
        angle = 2.0 * np.pi * index / count
        grid = np.column_stack([np.cos(angle), np.sin(angle)])
    elif config.layout == "line":
        grid = np.column_stack([index + 1.0, np.zeros(count)])
    elif config.layout == "grid":
        side = int(np.ceil(np.sqrt(count + 1)))
        grid = np.column_stack(np.divmod(index + 1, side)).astype(float)
    else:
        grid = (rng.random((count, 2)) - 0.5) * np.sqrt(count + 1)
    return FixedPlaces(np.vstack([grid * config.spacing_m, np.zeros((1, 2))]))
