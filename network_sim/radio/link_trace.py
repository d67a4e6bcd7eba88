"""Recorded links, and their replay in simulated time (SPEC 6.5); ``link_file`` reads them."""

from __future__ import annotations

import math
from bisect import bisect_left, bisect_right
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from network_sim.types import NS_PER_S, to_ns

FloatArray = NDArray[np.float64]

_FOR_EVER_NS = 2**62


@dataclass(frozen=True, slots=True)
class LinkTrace:
    """A recorded link, T rows; each is valid until the next, the last for the median time between rows."""

    t_s: FloatArray
    """(T,) times, rising from 0; a single row is valid for ever."""
    rate_bps: FloatArray
    """(T,) bits per second; 0 while nothing can be sent, but not in all rows."""
    round_trip_s: FloatArray
    """(T,) time from sender to receiver and back."""
    loss: FloatArray
    """(T,) share of packets that get lost, 0 to 1."""

    @property
    def edges_ns(self) -> NDArray[np.int64]:
        """(T + 1,) start times of the rows, and the end of the last one."""
        starts_ns = np.rint(self.t_s * NS_PER_S).astype(np.int64)
        last_ns = _FOR_EVER_NS
        if len(starts_ns) > 1:
            last_ns = int(starts_ns[-1] + np.rint(np.median(np.diff(starts_ns))))
        return np.append(starts_ns, last_ns)

    @property
    def mean_loss(self) -> float:
        """Loss averaged over time: the share lost of packets that are sent evenly in time."""
        return float(np.average(self.loss, weights=np.diff(self.edges_ns)))


def constant_link(rate_bps: float, round_trip_s: float, loss: float) -> LinkTrace:
    """Create a link that never changes."""
    return LinkTrace(*(np.array([value]) for value in (0.0, rate_bps, round_trip_s, loss)))


class Replay:
    """A recorded link that is replayed in a loop; its times are nanoseconds of the simulation."""

    def __init__(self, trace: LinkTrace, from_share: float = 0.0) -> None:
        """Start the simulation at the share ``from_share`` (0 to 1) of the recording."""
        edges_ns = trace.edges_ns
        with np.errstate(divide="ignore"):
            byte_ns = 8 * NS_PER_S / trace.rate_bps
        self._edges_ns: list[int] = edges_ns.tolist()
        self._byte_ns: list[float] = byte_ns.tolist()
        self._carried: list[float] = np.append(0.0, np.cumsum(np.diff(edges_ns) / byte_ns)).tolist()
        """Bytes that the link can carry from the start of the recording until each edge."""
        self._latency_ns = [to_ns(0.5 * round_trip_s) for round_trip_s in trace.round_trip_s.tolist()]
        self._loss: list[float] = trace.loss.tolist()
        self._span_ns = self._edges_ns[-1]
        self._start_ns = int(from_share * self._span_ns) if len(self._loss) > 1 else 0

    def opens_ns(self, now_ns: int) -> int:
        """Return the time from which the link can send: now, or when its rate rises above 0."""
        turn, _, row = self._at(now_ns)
        edge = bisect_right(self._carried, self._carried[row])
        if edge == len(self._carried):
            turn, edge = turn + 1, bisect_right(self._carried, 0.0)
        return max(now_ns, turn * self._span_ns + self._edges_ns[edge - 1] - self._start_ns)

    def ends_ns(self, now_ns: int, size_bytes: int) -> int:
        """Return the time at which the last bit is sent of a packet whose first bit is sent now."""
        turn, at_ns, row = self._at(now_ns)
        duration_ns = size_bytes * self._byte_ns[row]
        if at_ns + duration_ns <= self._edges_ns[row + 1]:
            return now_ns + round(duration_ns)
        target = self._carried[row] + (at_ns - self._edges_ns[row]) / self._byte_ns[row] + size_bytes
        turns = math.ceil(target / self._carried[-1]) - 1
        target -= turns * self._carried[-1]
        row = min(max(bisect_left(self._carried, target), 1), len(self._byte_ns)) - 1
        rest_ns = round((target - self._carried[row]) * self._byte_ns[row])
        return (turn + turns) * self._span_ns + self._edges_ns[row] + rest_ns - self._start_ns

    def latency_ns(self, now_ns: int) -> int:
        """Return the latency of a packet that is sent now: half the round trip."""
        return self._latency_ns[self._at(now_ns)[2]]

    def loss(self, now_ns: int) -> float:
        """Return the probability that a packet that is sent now gets lost."""
        return self._loss[self._at(now_ns)[2]]

    def _at(self, now_ns: int) -> tuple[int, int, int]:
        """Return the number of completed replays, the time in the current one, and the row of that time."""
        turn, at_ns = divmod(now_ns + self._start_ns, self._span_ns)
        return turn, at_ns, bisect_right(self._edges_ns, at_ns) - 1
