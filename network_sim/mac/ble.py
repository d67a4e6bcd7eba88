"""Bluetooth Low Energy at 2 Mbit/s: the sink polls each node in connection events, and nobody contends.

Every node is the peripheral of a connection whose central is the sink. Each connection has one event in each
connection interval, and the events share it equally. Within an event the central sends an empty frame, the
node answers with data, and so on, until the next exchange would not fit or the node has nothing left. The
central's next frame acknowledges. A frame that is lost ends the event, and the node sends it again in the
next one, until it arrives. What the sink has for a node takes the place of an empty frame, and the node's
empty frame acknowledges it. Empty frames always arrive; what the two exchange while there is no data is left
out.
"""

from __future__ import annotations

from collections.abc import Generator
from typing import Any

import simpy

from network_sim.mac.context import MacContext
from network_sim.radio.losses import LinkLosses
from network_sim.types import Cause, Delivery, EventKind, Packet, to_ns
from packetmesh.errors import InputError

BYTE_NS = 4_000
"""Time of a byte at 2 Mbit/s."""
EMPTY_BYTES = 11
"""Preamble 2, access address 4, header 2 and check sum 3, without encryption (Bluetooth Core 5.4, Vol 6, Part
B, 2.1, 2.4)."""
HEADER_BYTES = EMPTY_BYTES + 7
"""``EMPTY_BYTES``, with the headers of L2CAP (4) and of a notification of ATT (3)."""
SPACE_NS = 150_000
"""Silence between two frames of an event (T_IFS, Vol 6, Part B, 4.1.1)."""
POLL_NS = EMPTY_BYTES * BYTE_NS


def exchange_ns(payload_bytes: int) -> int:
    """Return the time from one frame of the central to its next, if one of the two carries data."""
    return POLL_NS + SPACE_NS + (HEADER_BYTES + payload_bytes) * BYTE_NS + SPACE_NS


class Ble:
    """Medium access of all nodes and the sink."""

    def __init__(self, context: MacContext) -> None:
        """Divide the connection interval among the nodes.

        Raises:
            InputError: a node's share is too short for one packet.
        """
        config, count = context.config, context.medium.places.count - 1
        self._context, self._env = context, context.env
        self._lost = LinkLosses(config.loss, config.run.seed).lost
        self._interval_ns = to_ns(config.mac.connection_interval_s)
        self._event_ns = self._interval_ns // count
        needed_ns = exchange_ns(config.nodes.payload_bytes)
        if self._event_ns < needed_ns:
            raise InputError(
                f"mac.connection_interval_s is {config.mac.connection_interval_s}, which leaves each of "
                f"{count} nodes {self._event_ns / 1e6:.3g} ms, too short for a packet, which takes "
                f"{needed_ns / 1e6:.3g} ms; try a longer interval or fewer nodes"
            )
        self._sink = count
        self._next_ns: dict[int, int] = {}
        """Time at which the central's next frame would follow in each node's event."""
        self._taken_ns: dict[int, int] = {}
        """End of the last exchange of each node and the central that has its time."""

    def send(self, packet: Packet, sender: int, receiver: int) -> Generator[simpy.Event, Any, Delivery]:
        """Carry a packet to a neighbour: ``delivery = yield from mac.send(packet, a, b)``.

        Returns:
            ``ok`` when the packet has arrived; only a node that is down gives a packet up.
        """
        env, up, attempts = self._env, self._context.up, 0
        node = receiver if sender == self._sink else sender
        while True:
            begins_ns = self._begins_ns(node, exchange_ns(packet.size_bytes))
            yield env.timeout(begins_ns - env.now)
            if not up(sender):
                return Delivery(False, Cause.NODE_DOWN, attempts)
            attempts += 1
            cause = yield from self._exchange(packet, sender, receiver, begins_ns)
            if not cause:
                self._next_ns[node] = begins_ns + exchange_ns(packet.size_bytes)
            if not cause:
                return Delivery(True, Cause.NONE, attempts)
            if cause is Cause.NODE_DOWN:
                return Delivery(False, cause, attempts)

    def _begins_ns(self, node: int, needed_ns: int) -> int:
        """Return when the next exchange with a node begins: in its present event, or in its next free one."""
        begins_ns = self._earliest_ns(node, needed_ns)
        self._taken_ns[node] = begins_ns + needed_ns
        return begins_ns

    def _earliest_ns(self, node: int, needed_ns: int) -> int:
        now_ns = int(self._env.now)
        next_ns = self._next_ns.pop(node, -1)
        taken_ns = self._taken_ns.get(node, 0)
        offset_ns = node * self._event_ns
        if next_ns >= max(now_ns, taken_ns):
            since_ns = (next_ns - offset_ns) % self._interval_ns
            if since_ns + needed_ns <= self._event_ns:
                return next_ns
        return offset_ns + -(-(max(now_ns, taken_ns) - offset_ns) // self._interval_ns) * self._interval_ns

    def _exchange(
        self, packet: Packet, sender: int, receiver: int, begins_ns: int
    ) -> Generator[simpy.Event, Any, Cause]:
        """Carry the packet in one exchange; returns why it was lost, or ``NONE``."""
        context, record = self._context, self._context.recorder.add_packet
        size_bytes, frame_bytes = packet.size_bytes, HEADER_BYTES + packet.size_bytes
        down, duration_ns = sender == self._sink, frame_bytes * BYTE_NS
        starts_ns = begins_ns if down else begins_ns + POLL_NS + SPACE_NS
        if not down:
            record(begins_ns, EventKind.ACK, packet, receiver, sender, EMPTY_BYTES, duration_ns=POLL_NS)
        record(starts_ns, EventKind.AIR, packet, sender, receiver, frame_bytes, duration_ns=duration_ns)
        frame = context.medium.start(sender, duration_ns, receiver, frame_bytes, "gfsk", starts_ns)
        yield self._env.timeout(frame.end_ns - self._env.now)
        lost = self._lost(sender, receiver)
        cause = context.medium.finish(frame) or (Cause.LINK if lost else Cause.NONE)
        if not (context.up(sender) and context.up(receiver)):
            cause = Cause.NODE_DOWN
        if cause:
            record(frame.end_ns, EventKind.LOSS, packet, sender, receiver, size_bytes, cause)
            return cause
        record(frame.end_ns, EventKind.DELIVER, packet, sender, receiver, size_bytes)
        if down:
            answers_ns = frame.end_ns + SPACE_NS
            record(answers_ns, EventKind.ACK, packet, receiver, sender, EMPTY_BYTES, duration_ns=POLL_NS)
        context.receive(packet, receiver)
        return cause
