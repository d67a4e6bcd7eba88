"""Links that nobody else uses: an ideal radio link and a serial line (SPEC 6.1, Model B)."""

from __future__ import annotations

from collections.abc import Callable, Generator
from typing import TYPE_CHECKING, Any

import numpy as np
import simpy

from network_sim.config import NetworkConfig
from network_sim.types import NS_PER_S, Cause, Delivery, EventKind, Packet

if TYPE_CHECKING:
    from network_sim.mac.medium import Medium
    from network_sim.trace import Recorder

IDEAL_BITS = 8
"""Bits on the link for a byte."""
SERIAL_BITS = 10
"""The same of a serial line: a start bit, 8 data bits, no parity, a stop bit."""


class OwnLink:
    """Every sender has a link of its own: it loses nothing but what a sleeping node misses."""

    def __init__(
        self,
        env: simpy.Environment,
        medium: Medium | None,
        config: NetworkConfig,
        recorder: Recorder,
        rng: np.random.Generator,
        up: Callable[[int], bool],
        receive: Callable[[Packet, int], None],
    ) -> None:
        """``config.mac`` gives the rate and whether the link is serial; ``medium`` and ``rng`` are unused."""
        self._env = env
        bits = SERIAL_BITS if config.mac.kind == "serial" else IDEAL_BITS
        self._byte_ns = bits * NS_PER_S / config.mac.link_bps
        self._recorder = recorder
        self._up = up
        self._receive = receive

    def send(self, packet: Packet, sender: int, receiver: int) -> Generator[simpy.Event, Any, Delivery]:
        """Carry a packet to a neighbour: ``delivery = yield from mac.send(packet, a, b)``."""
        env = self._env
        if not self._up(sender):
            return Delivery(False, Cause.NODE_DOWN, 0)
        size_bytes = packet.size_bytes
        start_ns = int(env.now)
        duration_ns = round(size_bytes * self._byte_ns)
        end_ns = start_ns + duration_ns
        record = self._recorder.add_packet
        record(start_ns, EventKind.AIR, packet, sender, receiver, size_bytes, duration_ns=duration_ns)
        yield env.timeout(duration_ns)
        if not (self._up(sender) and self._up(receiver)):
            cause = Cause.NODE_DOWN
            record(end_ns, EventKind.LOSS, packet, sender, receiver, size_bytes, cause)
            return Delivery(False, cause, 1)
        record(end_ns, EventKind.DELIVER, packet, sender, receiver, size_bytes)
        self._receive(packet, receiver)
        return Delivery(True, Cause.NONE, 1)
