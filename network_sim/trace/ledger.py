"""Ledger of the outcome and delay of every packet, or of every image, by id."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from network_sim.types import NS_PER_S

BINS_PER_DECADE = 200
"""Bins of the delay histogram per decade; each bin is 1.16 % wide."""
SHORTEST_S = 1e-6
"""Shortest delay with a bin of its own."""
_BINS = 12 * BINS_PER_DECADE
_UNSEEN = np.iinfo(np.int64).max


@dataclass(frozen=True, slots=True)
class Delays:
    """Distribution of delays; those under 1 us or over 11 days are in the histogram's first or last bin."""

    count: int
    total_s: float
    squares_s2: float
    """Sum of the squared delays."""
    histogram: NDArray[np.int64]
    """(B,) counts in bins of equal width on a logarithmic scale."""

    @property
    def mean_s(self) -> float:
        """Mean delay; NaN without delays."""
        return self.total_s / self.count if self.count else float("nan")

    @property
    def deviation_s(self) -> float:
        """Sample standard deviation; NaN for fewer than two delays."""
        if self.count < 2:
            return float("nan")
        return float(np.sqrt(max(self.squares_s2 - self.total_s**2 / self.count, 0.0) / (self.count - 1)))

    def percentile_s(self, percent: float) -> float:
        """Return a percentile of the delays, exact to one bin; NaN without delays."""
        if not self.count:
            return float("nan")
        rank = max(percent / 100.0 * self.count, 1.0)
        reached = np.cumsum(self.histogram)
        place = int(np.searchsorted(reached, rank))
        share = (rank - (reached[place] - self.histogram[place])) / self.histogram[place]
        return float(SHORTEST_S * 10.0 ** ((place + share) / BINS_PER_DECADE))


def delays_of(times_ns: NDArray[np.int64]) -> Delays:
    """Compute the distribution of delays (D,)."""
    times_s = times_ns / NS_PER_S
    place = np.floor(np.log10(np.maximum(times_s, SHORTEST_S) / SHORTEST_S) * BINS_PER_DECADE)
    histogram = np.bincount(np.clip(place, 0, _BINS - 1).astype(np.int64), minlength=_BINS)
    return Delays(len(times_s), float(times_s.sum()), float((times_s**2).sum()), histogram)


@dataclass(frozen=True, slots=True)
class Outcomes:
    """Numbers and delays of the packets or images that were created in a time span."""

    created: int
    arrived: int
    delays: Delays
    """Times from creation to arrival."""


class Ledger:
    """Creation time, arrival time, number of holding nodes and number of drops of each id."""

    def __init__(self, noun: str) -> None:
        self._noun = noun
        self._first_ns = np.zeros(0, np.int64)
        self._arrived_ns = np.zeros(0, np.int64)
        self._kind = np.zeros(0, np.int8)
        self._held = np.zeros(0, np.int16)
        self._arrivals = np.zeros(0, np.int16)
        self._losses = np.zeros(0, np.int16)

    def enter(self, ids: NDArray[np.int32], t_ns: NDArray[np.int64], kind: ArrayLike = 0) -> None:
        """Count packets or images that were created, or that entered one more node."""
        self._make_room(ids)
        np.add.at(self._held, ids, 1)
        np.minimum.at(self._first_ns, ids, t_ns)
        self._kind[ids] = kind

    def hand_on(self, ids: NDArray[np.int32]) -> None:
        """Count packets or images that left a node for the next one."""
        self._make_room(ids)
        np.subtract.at(self._held, ids, 1)

    def lose(self, ids: NDArray[np.int32]) -> None:
        """Count packets or images that were dropped by the node that held them."""
        self.hand_on(ids)
        np.add.at(self._losses, ids, 1)

    def arrive(self, ids: NDArray[np.int32], t_ns: NDArray[np.int64]) -> None:
        """Count packets or images that have reached their destination."""
        self._make_room(ids)
        np.add.at(self._arrivals, ids, 1)
        self._arrived_ns[ids] = t_ns

    def count(self) -> int:
        """Return the number of ids that were created."""
        return int(np.count_nonzero(self._first_ns != _UNSEEN))

    def outcomes(self, since_ns: int, kind: int = 0) -> Outcomes:
        """Return the outcomes of the ids of this kind that were created at or after ``since_ns``."""
        created = (self._first_ns != _UNSEEN) & (self._first_ns >= since_ns) & (self._kind == kind)
        arrived = created & (self._arrivals > 0)
        took_ns = self._arrived_ns[arrived] - self._first_ns[arrived]
        return Outcomes(int(created.sum()), int(arrived.sum()), delays_of(took_ns))

    def faults(self) -> list[str]:
        """Return the violated invariants as sentences, each with the first id that violates it."""
        seen, arrived, lost = self._first_ns != _UNSEEN, self._arrivals > 0, self._losses > 0
        rules = (
            ("has an end but no beginning", ~seen & (arrived | lost | (self._held != 0))),
            ("arrived more than once", self._arrivals > 1),
            ("arrived and was given up", arrived & lost),
            ("arrived and is still held by a node", seen & arrived & (self._held > 0)),
            ("is held by more than one node", seen & ~arrived & (self._held > 1)),
            ("left more nodes than it came to", seen & (self._held < 0)),
            ("vanished between two nodes", seen & ~arrived & ~lost & (self._held == 0)),
            ("arrived before it was created", seen & arrived & (self._arrived_ns < self._first_ns)),
        )
        return [f"{self._noun} {int(np.argmax(bad))} {what}" for what, bad in rules if bad.any()]

    def _make_room(self, ids: NDArray[np.int32]) -> None:
        if not len(ids):
            return
        length = int(ids.max()) + 1
        if ids.min() < 0:
            raise ValueError(f"A {self._noun} is recorded without its id")
        self._first_ns = grown(self._first_ns, length, _UNSEEN)
        for name in ("_arrived_ns", "_kind", "_held", "_arrivals", "_losses"):
            setattr(self, name, grown(getattr(self, name), length))


def grown(array: NDArray, length: int, fill: int = 0) -> NDArray:
    """Return ``array``, or a copy with at least ``length`` rows; the size doubles, so copies are rare."""
    if length <= len(array):
        return array
    larger = np.full((max(length, 2 * len(array), 16), *array.shape[1:]), fill, array.dtype)
    larger[: len(array)] = array
    return larger


def add_at(sums: NDArray[np.int64], row: NDArray[np.int64], column: NDArray[np.int64], what: NDArray) -> None:
    """Add numbers in place, as ``numpy.add.at`` but several times as fast, for sums below 2^53.

    Args:
        sums: (M, ...) array that is added to; the axes after the first are treated as flattened.
        row: (E,) indices on the first axis.
        column: (E,) indices on the flattened other axes.
        what: (E,) whole numbers to add.
    """
    if not len(row):
        return
    first, width = int(row.min()), math.prod(sums.shape[1:])
    count = int(row.max()) + 1 - first
    added = np.bincount((row - first) * width + column, what, count * width)
    sums[first : first + count] += added.astype(np.int64).reshape(count, *sums.shape[1:])
