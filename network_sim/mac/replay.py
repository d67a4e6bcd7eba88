"""Medium access that replays a recorded link for each sender: rate, latency and losses (SPEC 6.5)."""

from __future__ import annotations

from collections.abc import Generator
from typing import Any

import numpy as np
import simpy

from network_sim.mac.context import MacContext
from network_sim.radio.link_file import read_link_trace
from network_sim.radio.link_trace import Replay
from network_sim.radio.losses import LinkLosses
from network_sim.types import Cause, Delivery, EventKind, Packet
from packetmesh.errors import InputError

REPLAY_STREAM = 2
"""Number of this random stream, so that its draws are independent of others from the same seed."""


class RecordedLink:
    """A recorded link per sender, each replayed from a random start; the latency is half the round trip.

    A packet travels while the next one is sent: ``send`` returns after the last bit, and ``context.report``
    gets the outcome, with ``mac.ack`` a round trip after the last bit, else when the packet arrives or would
    have arrived. A frame that meets a rate of 0 stays on the air until its last bit is sent.
    """

    def __init__(self, context: MacContext) -> None:
        """Read the recording.

        Raises:
            InputError: ``mac.trace`` is empty, or its file cannot be read.
        """
        mac, self._seed = context.config.mac, context.config.run.seed
        if mac.trace is None:
            raise InputError("mac.trace names no recorded link; try a file with time, rate, round trip, loss")
        self._context = context
        self._ack = mac.ack
        self._trace = read_link_trace(mac.trace)
        self._lost = LinkLosses(context.config.loss, self._seed).lost
        self._links: dict[int, tuple[Replay, np.random.Generator]] = {}
        self._arrives_ns: dict[int, int] = {}
        """Arrival time of the last packet of each sender: no packet overtakes another."""

    def send(self, packet: Packet, sender: int, receiver: int) -> Generator[simpy.Event, Any, Delivery]:
        """Carry a packet to a neighbour: ``delivery = yield from mac.send(packet, a, b)``.

        Returns:
            The sender's knowledge; a packet that it has sent is ``under_way``.
        """
        env, up, size_bytes = self._context.env, self._context.up, packet.size_bytes
        record = self._context.recorder.add_packet
        link, rng = self._link(sender)
        yield env.timeout(link.opens_ns(int(env.now)) - int(env.now))
        if not up(sender):
            return Delivery(False, Cause.NODE_DOWN, 0)
        start_ns = int(env.now)
        duration_ns = link.ends_ns(start_ns, size_bytes) - start_ns
        record(start_ns, EventKind.AIR, packet, sender, receiver, size_bytes, duration_ns=duration_ns)
        yield env.timeout(duration_ns)
        now_ns = int(env.now)
        lost = self._lost(sender, receiver) | (rng.random() < link.loss(now_ns))
        if not up(sender):
            record(now_ns, EventKind.LOSS, packet, sender, receiver, size_bytes, Cause.NODE_DOWN)
            return Delivery(False, Cause.NODE_DOWN, 1)
        latency_ns = link.latency_ns(now_ns)
        arrives_ns = max(now_ns + latency_ns, self._arrives_ns.get(sender, 0))
        self._arrives_ns[sender] = arrives_ns
        env.process(self._travel(packet, sender, receiver, arrives_ns, latency_ns, lost))
        return Delivery(True, Cause.NONE, 1, under_way=True)

    def _travel(
        self, packet: Packet, sender: int, receiver: int, arrives_ns: int, latency_ns: int, lost: bool
    ) -> Generator[simpy.Event, Any, None]:
        """Deliver or lose a packet after its last bit was sent, then report the outcome to the sender."""
        context, env = self._context, self._context.env
        yield env.timeout(arrives_ns - int(env.now))
        cause = Cause.LINK if lost else Cause.NONE if context.up(receiver) else Cause.NODE_DOWN
        kind = EventKind.LOSS if cause else EventKind.DELIVER
        context.recorder.add_packet(arrives_ns, kind, packet, sender, receiver, packet.size_bytes, cause)
        if not cause:
            context.receive(packet, receiver)
        if self._ack:
            yield env.timeout(latency_ns)
        context.report(packet, sender, receiver, Delivery(not (cause and self._ack), cause, 1))

    def _link(self, sender: int) -> tuple[Replay, np.random.Generator]:
        """Return the sender's link and the random generator of its losses, created at first use."""
        found = self._links.get(sender)
        if found is None:
            rng = np.random.default_rng((self._seed, REPLAY_STREAM, sender))
            found = self._links[sender] = Replay(self._trace, float(rng.random())), rng
        return found
