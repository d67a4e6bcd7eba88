"""Links without contention: an ideal radio link and a serial line (SPEC 6.1, Model B)."""

from __future__ import annotations

from collections.abc import Generator
from typing import Any

import simpy

from network_sim.mac.context import MacContext
from network_sim.radio.losses import LinkLosses
from network_sim.types import NS_PER_S, Cause, Delivery, EventKind, Packet

IDEAL_BITS = 8
"""Bits per byte on an ideal link."""
SERIAL_BITS = 10
"""Bits per byte on a serial line: a start bit, 8 data bits, no parity, a stop bit."""


class OwnLink:
    """A separate link for each sender, whose only losses are those of ``config.loss``."""

    def __init__(self, context: MacContext) -> None:
        mac = context.config.mac
        self._context = context
        self._lost = LinkLosses(context.config.loss, context.config.run.seed).lost
        self._byte_ns = (SERIAL_BITS if mac.kind == "serial" else IDEAL_BITS) * NS_PER_S / mac.link_bps

    def send(self, packet: Packet, sender: int, receiver: int) -> Generator[simpy.Event, Any, Delivery]:
        """Carry a packet to a neighbour: ``delivery = yield from mac.send(packet, a, b)``."""
        env, up = self._context.env, self._context.up
        if not up(sender):
            return Delivery(False, Cause.NODE_DOWN, 0)
        size_bytes = packet.size_bytes
        start_ns = int(env.now)
        duration_ns = round(size_bytes * self._byte_ns)
        end_ns = start_ns + duration_ns
        record = self._context.recorder.add_packet
        record(start_ns, EventKind.AIR, packet, sender, receiver, size_bytes, duration_ns=duration_ns)
        yield env.timeout(duration_ns)
        cause = Cause.LINK if self._lost(sender, receiver) else Cause.NONE
        if not (up(sender) and up(receiver)):
            cause = Cause.NODE_DOWN
        if cause:
            record(end_ns, EventKind.LOSS, packet, sender, receiver, size_bytes, cause)
            return Delivery(False, cause, 1)
        record(end_ns, EventKind.DELIVER, packet, sender, receiver, size_bytes)
        self._context.receive(packet, receiver)
        return Delivery(True, Cause.NONE, 1)
