"""Unslotted IEEE 802.15.4 at 2.4 GHz: CSMA/CA with acknowledgement and retries (SPEC 6.1).

A node waits a random number of backoff periods, assesses the channel (CCA), switches its radio to sending
and sends. During this turnaround it hears nothing: a frame that another node starts then collides with its
own. Nothing is computed per slot: an attempt takes one simulation event for backoff and assessment, and one
for each part of the exchange; if nothing else happens meanwhile, one up to the end of the frame and one for
its acknowledgement.
"""

from __future__ import annotations

from collections.abc import Generator
from typing import Any

import simpy

from network_sim.mac.context import MacContext, random_below
from network_sim.radio.losses import LinkLosses
from network_sim.types import NS_PER_S, Cause, Delivery, EventKind, Packet

SYMBOL_NS = 16_000
BYTE_NS = 2 * SYMBOL_NS
LINK_BPS = 8 * NS_PER_S / BYTE_NS
"""Bit rate on the air: 250 kbit/s."""
BACKOFF_NS = 20 * SYMBOL_NS
CCA_NS = 8 * SYMBOL_NS
TURNAROUND_NS = 12 * SYMBOL_NS
ACK_WAIT_NS = 54 * SYMBOL_NS
"""Time from the end of a frame until its sender stops waiting for the end of the acknowledgement."""
PHY_BYTES = 6
"""Size of preamble, start of frame and length."""
CHECKED_BYTES = 5
"""Size of frame control, sequence number and check sum."""
HEADER_BYTES = CHECKED_BYTES + 6
"""``CHECKED_BYTES`` with a network address and two short node addresses."""
ACK_BYTES = PHY_BYTES + CHECKED_BYTES
ACK_NS = ACK_BYTES * BYTE_NS
ACKNOWLEDGED_NS = TURNAROUND_NS + ACK_NS
"""Time from the end of a frame to the end of its acknowledgement."""
MIN_BE = 3
MAX_BE = 5
MAX_CSMA_BACKOFFS = 4
MAX_FRAME_RETRIES = 3
_WINDOWS = tuple((1 << min(MIN_BE + busy, MAX_BE)) - 1 for busy in range(MAX_CSMA_BACKOFFS + 1))
"""Most backoff periods that a node waits, by the number of assessments that found the channel busy."""
_AIR, _ACK, _DELIVER, _NONE = EventKind.AIR, EventKind.ACK, EventKind.DELIVER, Cause.NONE
"""Local names, because enumeration members are slow to look up and these are used for every frame."""


def spacing_ns(frame_bytes: int) -> int:
    """Return the silence (SIFS or LIFS) after a frame; ``frame_bytes`` excludes the PHY header."""
    return (12 if frame_bytes <= 18 else 40) * SYMBOL_NS


class Ieee802154:
    """Medium access of all nodes of one channel."""

    def __init__(self, context: MacContext) -> None:
        self._env = context.env
        self._medium = context.medium
        self._next_ns = context.env.peek if context.medium.places.static else lambda: 0
        """Returns the time of the next event in ns; 0 if nodes move, so that no event is left out."""
        self._ack = context.config.mac.ack
        retries = context.config.mac.retries
        self._attempts = 1 + (MAX_FRAME_RETRIES if retries is None else retries) if self._ack else 1
        self._add = context.recorder.add_packet
        self._up = context.up
        self._receive = context.receive
        loss = context.config.loss
        self._losses = LinkLosses(loss, context.config.run.seed) if loss.share else None
        self._ready_ns: dict[int, int] = {}
        self._acking_until_ns: dict[int, int] = {}
        """Time until which each receiver is busy with an acknowledgement."""
        self._backoffs = random_below(1 << MAX_BE, context.rng)

    def send(self, packet: Packet, sender: int, receiver: int) -> Generator[simpy.Event, Any, Delivery]:
        """Carry a packet to a neighbour: ``delivery = yield from mac.send(packet, a, b)``.

        Returns:
            ``ok`` is the sender's knowledge, ``cause`` the true outcome: without acknowledgements a packet
            that was lost is ``ok`` with a cause; one that was dropped although it arrived has ``ACK_LOST``.
        """
        arrived, frame_bytes = False, PHY_BYTES + HEADER_BYTES + packet.size_bytes
        for attempt in range(self._attempts):
            refusal, begins_ns = yield from self._access(packet, sender, receiver)
            if refusal:
                return Delivery(False, Cause.ACK_LOST if arrived else refusal, attempt)
            ends_ns = begins_ns + frame_bytes * BYTE_NS
            cause = yield from self._transmit(packet, sender, receiver, frame_bytes, begins_ns)
            if not cause and not arrived:
                arrived = True
                self._add(ends_ns, _DELIVER, packet, sender, receiver, packet.size_bytes)
                self._receive(packet, receiver)
            if not self._ack:
                self._ready_ns[sender] = ends_ns + spacing_ns(frame_bytes - PHY_BYTES)
                return Delivery(self._up(sender), cause, 1)
            acknowledged = yield from self._acknowledge(packet, sender, receiver, cause, ends_ns)
            if acknowledged:
                self._ready_ns[sender] = ends_ns + ACKNOWLEDGED_NS + spacing_ns(frame_bytes - PHY_BYTES)
                return Delivery(True, _NONE, attempt + 1)
        return Delivery(False, Cause.ACK_LOST if arrived else Cause.RETRIES, self._attempts)

    def _access(
        self, packet: Packet, sender: int, receiver: int
    ) -> Generator[simpy.Event, Any, tuple[Cause, int]]:
        """Wait for an idle channel (CSMA/CA), without a simulation event if nothing else happens before.

        Returns:
            Why the sender may not send, or ``NONE``, and the start of its frame in ns.
        """
        env, waited_ns = self._env, int(self._env.now)
        at_ns = max(self._ready_ns.get(sender, 0), waited_ns)
        for window in _WINDOWS:
            at_ns += (next(self._backoffs) & window) * BACKOFF_NS + CCA_NS
            if self._next_ns() <= at_ns:
                yield env.timeout(at_ns - waited_ns)
                waited_ns = at_ns
            if not self._up(sender):
                refusal = Cause.NODE_DOWN
                break
            if not self._busy(sender, at_ns):
                begins_ns = at_ns + TURNAROUND_NS
                if self._next_ns() <= begins_ns:
                    yield env.timeout(begins_ns - waited_ns)
                return (_NONE if self._up(sender) else Cause.NODE_DOWN), begins_ns
        else:
            refusal = Cause.CHANNEL
        if at_ns > waited_ns:
            yield env.timeout(at_ns - waited_ns)
        if refusal is Cause.CHANNEL:
            self._record(EventKind.LOSS, packet, sender, receiver, packet.size_bytes, refusal)
        return refusal, at_ns

    def _busy(self, node: int, at_ns: int) -> bool:
        """Return whether an assessment that ends at ``at_ns`` finds the channel or the node itself busy.

        The end of the assessment decides (as in ns-3's lr-wpan): only the turnaround is vulnerable.
        ``at_ns`` is now, or later if nothing happens before. A node is busy while it sends an
        acknowledgement.
        """
        return at_ns < self._acking_until_ns.get(node, 0) or self._medium.busy_until(node, at_ns)

    def _transmit(
        self, packet: Packet, sender: int, receiver: int, frame_bytes: int, begins_ns: int
    ) -> Generator[simpy.Event, Any, Cause]:
        """Put the frame on the air at ``begins_ns``, now or later; returns why it was lost, or ``NONE``."""
        env, duration_ns = self._env, frame_bytes * BYTE_NS
        self._add(begins_ns, _AIR, packet, sender, receiver, frame_bytes, _NONE, duration_ns)
        transmission = self._medium.start(sender, duration_ns, receiver, frame_bytes, "oqpsk", begins_ns)
        yield env.timeout(begins_ns + duration_ns - env.now)
        lost = self._losses is not None and self._losses.lost(sender, receiver)
        cause = self._medium.finish(transmission) or (Cause.LINK if lost else _NONE)
        if not (self._up(sender) and self._up(receiver)):
            cause = Cause.NODE_DOWN
        if cause:
            self._record(EventKind.LOSS, packet, sender, receiver, packet.size_bytes, cause)
        return cause

    def _acknowledge(
        self, packet: Packet, sender: int, receiver: int, cause: Cause, ended_ns: int
    ) -> Generator[simpy.Event, Any, bool]:
        """Send the acknowledgement of a frame that has just ended, unless the frame failed for ``cause``.

        Returns:
            Whether the frame's sender has received the acknowledgement.
        """
        env = self._env
        if cause:
            yield env.timeout(ACK_WAIT_NS)
            return False
        begins_ns = ended_ns + TURNAROUND_NS
        self._acking_until_ns[receiver] = begins_ns + ACK_NS
        rest_ns = ACKNOWLEDGED_NS
        if self._next_ns() <= begins_ns:
            yield env.timeout(TURNAROUND_NS)
            rest_ns = ACK_NS
        heard = False
        if self._up(receiver):
            self._add(begins_ns, _ACK, packet, receiver, sender, ACK_BYTES, _NONE, ACK_NS)
            transmission = self._medium.start(receiver, ACK_NS, sender, ACK_BYTES, "oqpsk", begins_ns)
            yield env.timeout(rest_ns)
            failure = self._medium.finish(transmission)
            heard = not failure and self._up(sender)
        else:
            yield env.timeout(rest_ns)
        if not heard:
            self._record(EventKind.LOSS, packet, sender, receiver, packet.size_bytes, Cause.ACK_LOST)
            yield env.timeout(ACK_WAIT_NS - ACKNOWLEDGED_NS)
        return heard

    def _record(
        self,
        kind: EventKind,
        packet: Packet,
        node: int,
        peer: int,
        size_bytes: int,
        cause: Cause = Cause.NONE,
    ) -> None:
        self._add(int(self._env.now), kind, packet, node, peer, size_bytes, cause, 0)
