"""Time that each radio spends sending, asleep and receiving, computed from frames and failures."""

from __future__ import annotations

from enum import IntEnum
from typing import Any

import numpy as np
from numpy.typing import NDArray

from network_sim.trace.ledger import add_at, grown
from network_sim.types import NS_PER_S, EventKind

MINUTE_NS = 60 * NS_PER_S
_LATE_NS = NS_PER_S

Spans = NDArray[np.int64]
"""(I, 3) intervals: node, start and end in ns."""


class State(IntEnum):
    """State of a node's radio; outside these states it listens."""

    SENDING = 0
    ASLEEP = 1
    """Asleep or failed, and not sending."""
    RECEIVING = 2
    """A frame addressed to the node is on the air, and the node neither sends nor sleeps."""


class StateTimes:
    """Sums of the time in each state per minute, counted from ``start_ns``.

    Times are added with a delay of one second, so that rows may come in any order within a second.
    """

    def __init__(self, nodes: int, start_ns: int) -> None:
        self._nodes = nodes
        self._start_ns = start_ns
        self._sums = np.zeros((0, nodes, len(State)), np.int64)
        self._settled_ns = 0
        self._spans = {state: np.zeros((0, 3), np.int64) for state in State}
        self._down_since_ns: dict[int, int] = {}
        self.late = 0
        """Number of rows that came too late to be counted in full."""

    def take(self, rows: NDArray[Any]) -> None:
        """Count rows (E,) of the trace."""
        kind = rows["kind"]
        frames = rows[(kind == EventKind.AIR) | (kind == EventKind.ACK)]
        changes = rows[(kind == EventKind.DOWN) | (kind == EventKind.UP)]
        newest_ns = max((int(part["t_ns"].max()) for part in (frames, changes) if len(part)), default=0)
        self.late += sum(int((part["t_ns"] < self._settled_ns).sum()) for part in (frames, changes))
        end_ns = frames["t_ns"] + frames["duration_ns"]
        self._add(State.SENDING, np.column_stack((frames["node"], frames["t_ns"], end_ns)))
        heard = np.column_stack((frames["peer"], frames["t_ns"], end_ns))
        self._add(State.RECEIVING, heard[frames["peer"] >= 0])
        for row in changes:
            self._change(int(row["kind"]), int(row["node"]), int(row["t_ns"]))
        self._settle(newest_ns - _LATE_NS)

    def sums(self, horizon_ns: int, minutes: int) -> NDArray[np.int64]:
        """Return (M, N, S) nanoseconds in each state until the end of the run."""
        self._settle(horizon_ns)
        return grown(self._sums, minutes)[:minutes]

    def _add(self, state: State, spans: Spans) -> None:
        self._spans[state] = np.concatenate((self._spans[state], spans))

    def _change(self, kind: int, node: int, t_ns: int) -> None:
        if kind == EventKind.DOWN:
            self._down_since_ns.setdefault(node, t_ns)
        elif node in self._down_since_ns:
            self._add(State.ASLEEP, np.array([[node, self._down_since_ns.pop(node), t_ns]]))

    def _settle(self, until_ns: int) -> None:
        """Count the spans up to ``until_ns``, and keep their later parts."""
        if until_ns <= self._settled_ns:
            return
        for node, since_ns in self._down_since_ns.items():
            if since_ns < until_ns:
                self._add(State.ASLEEP, np.array([[node, since_ns, until_ns]]))
                self._down_since_ns[node] = until_ns
        together = np.zeros((0, 3), np.int64)
        for state in State:
            spans = self._spans[state]
            due = spans[spans[:, 1] < until_ns]
            due[:, 1] = np.maximum(due[:, 1], self._settled_ns)
            later = spans[spans[:, 2] > until_ns]
            later[:, 1] = np.maximum(later[:, 1], until_ns)
            self._spans[state] = later
            due[:, 2] = np.minimum(due[:, 2], until_ns)
            if not len(due):
                continue
            before, together = together, disjoint(np.concatenate((together, due)))
            self._count(state, together, 1)
            self._count(state, before, -1)
        self._settled_ns = until_ns

    def _count(self, state: State, spans: Spans, sign: int) -> None:
        """Add the spans' lengths to the minutes that they cover."""
        node, start_ns, end_ns = (spans - np.array([0, self._start_ns, self._start_ns])).T
        while len(node):
            minute = start_ns // MINUTE_NS
            self._sums = grown(self._sums, int(minute.max()) + 1)
            cut_ns = np.minimum(end_ns, (minute + 1) * MINUTE_NS)
            add_at(self._sums[:, :, state], minute, node, sign * (cut_ns - start_ns))
            rest = end_ns > cut_ns
            node, start_ns, end_ns = node[rest], cut_ns[rest], end_ns[rest]


def disjoint(spans: Spans) -> Spans:
    """Merge the spans of each node into spans that do not overlap and cover the same times."""
    spans = spans[np.lexsort((spans[:, 1], spans[:, 0]))]
    if not len(spans):
        return spans
    node, start_ns, end_ns = spans.T
    lane_ns = node * (int(end_ns.max()) + 1)  # shifts the nodes apart: one running maximum serves all
    reached_ns = np.maximum.accumulate(end_ns + lane_ns)
    start_ns = start_ns.copy()
    start_ns[1:] = np.maximum(start_ns[1:], reached_ns[:-1] - lane_ns[1:])
    return np.column_stack((node, start_ns, end_ns))[end_ns > start_ns]
