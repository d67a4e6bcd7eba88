"""Counters of a run: sums over its events, from which most metrics are computed.

Events are counted in blocks of recorded rows, which keeps recording fast. Counts are whole numbers and do not
depend on whether the log is kept.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from network_sim.trace.ledger import Ledger, Outcomes, add_at, grown
from network_sim.trace.states import MINUTE_NS, StateTimes
from network_sim.types import Cause, EventKind, PacketKind

_SUMS = ("count", "size_bytes", "duration_ns", "offset_ns")
_SHAPE = (len(EventKind), len(PacketKind), len(Cause))


@dataclass(frozen=True, slots=True)
class Counters:
    """Sums per minute of simulated time. Minute ``warmup_minutes`` starts exactly at the end of the warm-up.

    The first and the last minute may be shorter than 60 s. Axes of the arrays: M minutes, K event kinds,
    P packet kinds, C causes, N nodes, S states.
    """

    count: NDArray[np.int64]
    """(M, K, P, C) number of events."""
    size_bytes: NDArray[np.int64]
    """(M, K, P, C) sum of the events' sizes."""
    duration_ns: NDArray[np.int64]
    """(M, K, P, C) sum of the durations, each counted in the minute in which its event began."""
    until_end_ns: NDArray[np.int64]
    """(M, K, P, C) sum of the times from each event to the end of its minute, for the mean queue length."""
    states_ns: NDArray[np.int64]
    """(M, N, S) time in each ``State``; a frame that spans two minutes is divided between them."""
    edges_ns: NDArray[np.int64]
    """(M + 1,) limits of the minutes, from 0 to the horizon."""
    warmup_minutes: int
    """Number of minutes before the end of the warm-up."""
    packets: Outcomes
    """Outcomes of IMAGE packets that were created after the warm-up."""
    images: Outcomes
    """Outcomes of images that were taken after the warm-up."""
    created: int
    """Number of packets of the whole run, counted by id."""
    captured: int
    """Number of images of the whole run, counted by id."""
    faults: tuple[str, ...]
    """Violated invariants as sentences; empty when there are none."""


class Tally:
    """Accumulates the counters from blocks of recorded rows.

    Args:
        nodes: number of nodes.
        warmup_ns: end of the warm-up.
    """

    def __init__(self, nodes: int, warmup_ns: int) -> None:
        self._warmup_ns = warmup_ns
        self._before = -(-warmup_ns // MINUTE_NS)
        self._start_ns = warmup_ns - self._before * MINUTE_NS
        self._sums = np.zeros((0, len(_SUMS), *_SHAPE), np.int64)
        self._states = StateTimes(nodes, self._start_ns)
        self._packets = Ledger("packet")
        self._images = Ledger("image")

    def take(self, rows: NDArray[Any]) -> None:
        """Count rows (E,) with the columns of the trace, in the order of recording."""
        since_ns = rows["t_ns"] - self._start_ns
        minute = since_ns // MINUTE_NS
        self._sums = grown(self._sums, int(minute.max()) + 1)
        offset_ns = since_ns - minute * MINUTE_NS
        place = (rows["kind"] * np.int64(_SHAPE[1]) + rows["packet_kind"]) * _SHAPE[2] + rows["cause"]
        ones = np.ones(len(rows))
        for index, what in enumerate((ones, rows["size_bytes"], rows["duration_ns"], offset_ns)):
            add_at(self._sums[:, index], minute, place, what)
        self._states.take(rows)
        self._take_packets(rows)
        self._take_images(rows)

    def _take_packets(self, rows: NDArray[Any]) -> None:
        entered = rows[rows["kind"] == EventKind.ENQUEUE]
        self._packets.enter(entered["packet"], entered["t_ns"], entered["packet_kind"])
        self._packets.hand_on(rows["packet"][rows["kind"] == EventKind.DELIVER])
        self._packets.lose(rows["packet"][rows["kind"] == EventKind.DROP])
        received = rows[rows["kind"] == EventKind.RECEIVE]
        self._packets.arrive(received["packet"], received["t_ns"])

    def _take_images(self, rows: NDArray[Any]) -> None:
        taken = rows[rows["kind"] == EventKind.CAPTURE]
        self._images.enter(taken["image"], taken["t_ns"])
        arrived = rows[rows["kind"] == EventKind.ARRIVE]
        self._images.hand_on(arrived["image"])
        self._images.arrive(arrived["image"], arrived["t_ns"])
        self._images.lose(rows["image"][rows["kind"] == EventKind.EXPIRE])

    def counters(self, horizon_ns: int) -> Counters:
        """Return the counters of the run, which ended at ``horizon_ns``."""
        minutes = max(-(-(horizon_ns - self._start_ns) // MINUTE_NS), 1)
        sums = grown(self._sums, minutes)
        for late in range(minutes, len(sums)):  # events exactly at the horizon
            sums[minutes - 1] += sums[late]
            sums[minutes - 1, 3] += (late - minutes + 1) * MINUTE_NS * sums[late, 0]
        edges_ns = self._start_ns + MINUTE_NS * np.arange(minutes + 1)
        edges_ns[0], edges_ns[-1] = 0, horizon_ns
        ends_ns = edges_ns[1:] - (self._start_ns + MINUTE_NS * np.arange(minutes))
        count, size_bytes, duration_ns, offset_ns = np.moveaxis(sums[:minutes], 1, 0)
        states_ns = self._states.sums(horizon_ns, minutes)
        faults = [*self._packets.faults(), *self._images.faults()]
        if self._states.late:
            faults.append(f"{self._states.late} frames or failures were recorded more than a second late")
        return Counters(
            count=count,
            size_bytes=size_bytes,
            duration_ns=duration_ns,
            until_end_ns=count * ends_ns[:, None, None, None] - offset_ns,
            states_ns=states_ns,
            edges_ns=edges_ns,
            warmup_minutes=min(self._before, minutes),
            packets=self._packets.outcomes(self._warmup_ns),
            images=self._images.outcomes(self._warmup_ns),
            created=self._packets.count(),
            captured=self._images.count(),
            faults=tuple(faults),
        )
