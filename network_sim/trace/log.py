"""The trace of a run: an append-only log of events, and counters that exist even if the log is not kept.

The log satisfies these invariants; ``network_sim.trace.conservation`` checks them on every run.

1. Ids of packets and of images count up from 0. A fragment that its camera sends again is a new packet.
2. Every packet that is handed to a node's buffer is ENQUEUEd there, on relays too, and also when the buffer
   is full: then a DROP with ``Cause.BUFFER``, of that packet or of the oldest, follows.
3. The packet leaves that node once, by DELIVER (``node`` to ``peer``) or by DROP (``node``). A packet that
   has arrived is never DROPped by its sender, even if the acknowledgement is lost.
4. At the instant of DELIVER the next node ENQUEUEs the packet; at its destination RECEIVE is recorded
   instead (``node`` is the source, ``peer`` the destination).
5. An image is CAPTUREd once (``node`` took it, ``peer`` is the road cell that it shows, or -1) and closed at
   most once: by ARRIVE (``node`` took it, ``peer`` has received all its bytes, or the bytes
   [first_byte, first_byte + size_bytes) that it requested) or EXPIRE (``node`` took it).
6. AIR and ACK carry their start time and duration, and are recorded within a second of the start.
7. DOWN means a failure with ``Cause.NODE_DOWN`` and sleep with ``Cause.NONE``; UP is the end of either.

The log is sorted by time at the end, because some records (CAPTUREs on the street) are added late.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, fields
from struct import Struct, calcsize
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from network_sim.config import Keep, NetworkConfig
from network_sim.trace.counters import Counters, Tally
from network_sim.types import Cause, EventKind, Packet, PacketKind, to_ns

COLUMNS = (
    ("t_ns", "<i8"),
    ("duration_ns", "<i8"),
    ("packet", "<i4"),
    ("image", "<i4"),
    ("first_byte", "<i4"),
    ("size_bytes", "<i4"),
    ("node", "<i2"),
    ("peer", "<i2"),
    ("kind", "i1"),
    ("cause", "i1"),
    ("packet_kind", "i1"),
)
_ROW = np.dtype(list(COLUMNS))
_FORMAT = "<qqiiiihhbbb"
_BLOCK_BYTES = 65536 * calcsize(_FORMAT)

IMAGE_EVENTS = (
    EventKind.CAPTURE,
    EventKind.ARRIVE,
    EventKind.EXPIRE,
    EventKind.DOWN,
    EventKind.UP,
    EventKind.JOIN,
    EventKind.LEAVE,
)
"""Kinds of events that the log keeps when ``keep`` is "images"."""


@dataclass(frozen=True, slots=True)
class Events:
    """Columns (E,) of the log, sorted by time; simultaneous events keep the order of recording."""

    t_ns: NDArray[np.int64]
    duration_ns: NDArray[np.int64]
    packet: NDArray[np.int32]
    image: NDArray[np.int32]
    first_byte: NDArray[np.int32]
    size_bytes: NDArray[np.int32]
    node: NDArray[np.int16]
    peer: NDArray[np.int16]
    kind: NDArray[np.int8]
    cause: NDArray[np.int8]
    packet_kind: NDArray[np.int8]

    def __len__(self) -> int:
        return len(self.t_ns)

    def columns(self) -> Iterator[NDArray[np.generic]]:
        """Return the columns in the order of ``COLUMNS``."""
        return (getattr(self, field.name) for field in fields(self))

    def rows(self, start: int, stop: int) -> NDArray[Any]:
        """Return the events from ``start`` to ``stop`` as rows, the input of ``Tally.take``."""
        rows = np.empty(len(self.t_ns[start:stop]), _ROW)
        for name, _ in COLUMNS:
            rows[name] = getattr(self, name)[start:stop]
        return rows

    def where(self, mask: NDArray[np.bool_]) -> Events:
        """Return the events that ``mask`` (E,) selects."""
        return Events(*(column[mask] for column in self.columns()))  # type: ignore[arg-type]

    def of(self, *kinds: EventKind) -> Events:
        """Return the events of these kinds."""
        return self.where(np.isin(self.kind, np.array(kinds, np.int8)))


@dataclass(frozen=True, slots=True)
class NetworkTrace:
    """The result of one run."""

    events: Events
    """The log: all events, only ``IMAGE_EVENTS``, or none, according to ``config.run.keep``."""
    counters: Counters
    names: tuple[str, ...]
    """Names of the nodes, sink and cloud included, in the order of their numbers."""
    roles: tuple[str, ...]
    """"node", "vehicle", "access-point", "sink" or "cloud", one per name."""
    positions_m: NDArray[np.float64] | None
    """(N, 2) x and y of each node; None if the nodes move."""
    config: NetworkConfig
    horizon_ns: int
    """Time at which the run ended."""


class Recorder:
    """Appends events to the log and counts them.

    Args:
        keep: "all" keeps the log, "images" only ``IMAGE_EVENTS``, "counters" none of it.
        nodes: number of nodes, sink, access points and cloud included.
        warmup_ns: end of the warm-up (``config.run.warmup_s``); earlier events are counted separately.
    """

    def __init__(self, keep: Keep, nodes: int, warmup_ns: int = 0) -> None:
        self._keep = keep
        self._warmup_ns = warmup_ns
        self._tally = Tally(nodes, warmup_ns)
        self._rows = bytearray()
        self._pack = Struct(_FORMAT).pack
        self._blocks: list[NDArray[Any]] = []

    def add(
        self,
        t_ns: int,
        kind: EventKind,
        node: int,
        peer: int = -1,
        packet: int = -1,
        image: int = -1,
        first_byte: int = 0,
        size_bytes: int = 0,
        cause: Cause = Cause.NONE,
        duration_ns: int = 0,
        packet_kind: PacketKind = PacketKind.IMAGE,
    ) -> None:
        """Record one event. Packing it into bytes takes a third of the time of a tuple in a list."""
        rows = self._rows
        rows += self._pack(
            t_ns, duration_ns, packet, image, first_byte, size_bytes, node, peer, kind, cause, packet_kind
        )
        if len(rows) >= _BLOCK_BYTES:
            self._flush()

    def add_packet(
        self,
        t_ns: int,
        kind: EventKind,
        packet: Packet,
        node: int,
        peer: int,
        size_bytes: int,
        cause: Cause = Cause.NONE,
        duration_ns: int = 0,
    ) -> None:
        """Record an event of a packet at ``node``, towards ``peer``.

        ``size_bytes`` is the size of the frame for AIR and ACK, else of the packet.
        """
        number, packet_kind, _, _, _, image, first_byte, _ = packet
        rows = self._rows
        rows += self._pack(
            t_ns, duration_ns, number, image, first_byte, size_bytes, node, peer, kind, cause, packet_kind
        )
        if len(rows) >= _BLOCK_BYTES:
            self._flush()

    def add_many(self, t_ns: ArrayLike, kind: EventKind, node: ArrayLike, **values: ArrayLike) -> None:
        """Record many events of one kind: numbers or arrays (E,), named as in ``add``."""
        block = np.zeros(np.size(t_ns), _ROW)
        columns = {"peer": -1, "packet": -1, "image": -1, **values, "t_ns": t_ns, "kind": kind, "node": node}
        for name, column in columns.items():
            block[name] = column
        self._rows += block.tobytes()
        if len(self._rows) >= _BLOCK_BYTES:
            self._flush()

    def trace(
        self,
        config: NetworkConfig,
        names: tuple[str, ...],
        positions_m: NDArray[np.float64] | None,
        horizon_ns: int,
        roles: tuple[str, ...],
    ) -> NetworkTrace:
        """Return the trace of the run, which ended at ``horizon_ns``; no event may be added after this.

        Raises:
            ValueError: the recorder was made for another warm-up.
        """
        if self._warmup_ns != to_ns(config.run.warmup_s):
            raise ValueError(f"The recorder's warm-up is {self._warmup_ns} ns, run.warmup_s another")
        self._flush()
        counters = self._tally.counters(horizon_ns)
        events = _sorted_columns(self._blocks)
        return NetworkTrace(events, counters, names, roles, positions_m, config, horizon_ns)

    def _flush(self) -> None:
        if not self._rows:
            return
        block = np.frombuffer(self._rows, _ROW)
        self._rows = bytearray()
        self._tally.take(block)
        if self._keep == "images":
            block = block[np.isin(block["kind"], np.array(IMAGE_EVENTS, np.int8))]
        if self._keep != "counters" and len(block):
            self._blocks.append(block)


def _sorted_columns(blocks: list[NDArray[Any]]) -> Events:
    """Join the blocks into columns sorted by time; ``blocks`` is emptied to save memory."""
    rows = np.concatenate(blocks) if blocks else np.zeros(0, _ROW)
    blocks.clear()
    t_ns = rows["t_ns"].copy()
    if (t_ns[1:] >= t_ns[:-1]).all():
        return Events(t_ns, *(rows[name].copy() for name, _ in COLUMNS[1:]))
    order = np.argsort(t_ns, kind="stable")
    return Events(t_ns[order], *(rows[name][order] for name, _ in COLUMNS[1:]))
