"""LoRaWAN in the EU's 868 MHz band: ALOHA with capture, a duty cycle of 1 %, and replies of class A.

A node sends when its duty cycle allows it, and listens to nobody before. All nodes share one channel of
125 kHz and one spreading factor. The gateway reaches a node only in its first receive window, a second after
an uplink of this node, and only if its own duty cycle allows it; while it sends, it receives nothing. What
the network has for a node waits for such a window. The second window (869.525 MHz) and further channels are
left out; a downlink is disturbed by uplinks as if its chirps were not inverted.
"""

from __future__ import annotations

from collections.abc import Generator
from typing import Any

import simpy

from network_sim.config import NetworkConfig
from network_sim.mac.context import MacContext
from network_sim.radio.losses import LinkLosses
from network_sim.types import NS_PER_S, Cause, Delivery, EventKind, Packet

BANDWIDTH_HZ = 125_000
CODING_RATE = 1
"""4/5: one parity bit for four bits."""
PREAMBLE_SYMBOLS = 8
HEADER_BYTES = 13
"""MHDR 1, device address 4, FCtrl 1, FCnt 2, FPort 1, MIC 4 (LoRaWAN 1.0.3, section 4)."""
ACK_BYTES = 12
"""An empty downlink: as ``HEADER_BYTES``, without FPort."""
RECEIVE_DELAY_NS = NS_PER_S
"""Time from the end of an uplink to the first receive window (RECEIVE_DELAY1, Regional Parameters 1.0.3)."""
PERIODS_PER_AIRTIME = 100
"""A sender's period for each of its frames, in airtimes: the duty cycle of 1 % from 868.0 to 868.6 MHz."""
JITTER_AIRTIMES = 2.0
"""Largest random wait after a period, in airtimes (ours): nodes with equal frames would collide for ever."""
MAX_RETRIES = 7
"""A confirmed frame is sent at most eight times (LoRaWAN 1.0.2, 18.4)."""
LIFETIME_PACES = 6
"""Time in a node's periods after which a downlink is given up: a camera that waits for one sends earlier."""


def airtime_ns(frame_bytes: int, spreading_factor: int, checked: bool = True) -> int:
    """Return the time on the air (Semtech AN1200.13; SX1276 data sheet, 4.1.1.7).

    With T_s = 2^SF / BW: ``(8 + 4.25) T_s + (8 + max(ceil((8 PL - 4 SF + 28 + 16 CRC) / (4 (SF - 2 DE)))
    (CR + 4), 0)) T_s``, with an explicit header; DE = 1 (low data rate optimisation) from SF 11 on.

    Args:
        frame_bytes: PL, the bytes of the physical payload, ``HEADER_BYTES`` included.
        spreading_factor: SF, 7 to 12.
        checked: whether a check sum of 16 bits follows (CRC); LoRaWAN has one in uplinks only.
    """
    symbol_ns = (1 << spreading_factor) * NS_PER_S // BANDWIDTH_HZ
    per_block = 4 * (spreading_factor - 2 * (spreading_factor >= 11))
    bits = 8 * frame_bytes - 4 * spreading_factor + 28 + 16 * checked
    payload_symbols = 8 + max(-(-bits // per_block) * (CODING_RATE + 4), 0)
    return (4 * PREAMBLE_SYMBOLS + 17) * symbol_ns // 4 + payload_symbols * symbol_ns


def period_ns(config: NetworkConfig) -> int:
    """Return the time from one full packet of a node to its next at the duty cycle."""
    frame_bytes = HEADER_BYTES + config.nodes.payload_bytes
    return PERIODS_PER_AIRTIME * airtime_ns(frame_bytes, config.mac.spreading_factor)


class Lora:
    """Medium access of all nodes and the gateway, which is the sink."""

    def __init__(self, context: MacContext) -> None:
        """Create the medium access; the gateway is the last node of the channel."""
        config = context.config
        self._context, self._env, self._medium = context, context.env, context.medium
        self._gateway = context.medium.places.count - 1
        self._spreading_factor, self._ack = config.mac.spreading_factor, config.mac.ack
        retries = MAX_RETRIES if config.mac.retries is None else config.mac.retries
        self._attempts = 1 + retries if self._ack else 1
        self._lifetime_ns = LIFETIME_PACES * period_ns(config)
        self._lost = LinkLosses(config.loss, config.run.seed).lost
        self._free_ns: dict[int, int] = {}
        """Time from which each sender may send again."""
        self._waiting: dict[int, Packet] = {}
        """Downlink that waits for the next receive window of each node."""

    def send(self, packet: Packet, sender: int, receiver: int) -> Generator[simpy.Event, Any, Delivery]:
        """Carry a packet to a neighbour: ``delivery = yield from mac.send(packet, a, b)``.

        Returns:
            A packet that was sent is ``under_way``; its outcome is reported before its sender may send
            again, when this returns. Without acknowledgements every uplink is ``ok`` for its sender.
        """
        if sender == self._gateway:
            self._enqueue(packet, receiver)
            return Delivery(True, Cause.NONE, 0, under_way=True)
        arrived = False
        for attempt in range(1, self._attempts + 1):
            yield self._env.timeout(max(0, self._free_ns.get(sender, 0) - self._env.now))
            if not self._context.up(sender):
                return Delivery(False, Cause.ACK_LOST if arrived else Cause.NODE_DOWN, attempt - 1)
            cause = yield from self._transmit(packet, sender, receiver, True)
            if not cause and not arrived:
                arrived = True
                self._deliver(packet, sender, receiver)
            if not self._ack:
                outcome = Delivery(self._context.up(sender), cause, 1)
                if not cause:
                    self._env.process(self._open_window(sender))
                break
            acknowledged = yield from self._acknowledge(packet, sender, receiver, cause)
            if acknowledged:
                outcome = Delivery(True, Cause.NONE, attempt)
                break
        else:
            outcome = Delivery(False, Cause.ACK_LOST if arrived else Cause.RETRIES, self._attempts)
        self._context.report(packet, sender, receiver, outcome)
        yield self._env.timeout(max(0, self._free_ns[sender] - self._env.now))
        return Delivery(True, Cause.NONE, outcome.attempts, under_way=True)

    def _transmit(
        self, packet: Packet, sender: int, receiver: int, uplink: bool
    ) -> Generator[simpy.Event, Any, Cause]:
        """Put a frame on the air now; returns why it was lost, or ``NONE``."""
        context, frame_bytes = self._context, HEADER_BYTES + packet.size_bytes
        begins_ns, duration_ns = int(self._env.now), airtime_ns(frame_bytes, self._spreading_factor, uplink)
        self._occupy(sender, duration_ns)
        record = context.recorder.add_packet
        record(begins_ns, EventKind.AIR, packet, sender, receiver, frame_bytes, duration_ns=duration_ns)
        frame = self._medium.start(sender, duration_ns, receiver, frame_bytes, "lora")
        yield self._env.timeout(duration_ns)
        lost = self._lost(sender, receiver)
        cause = self._medium.finish(frame) or (Cause.LINK if lost else Cause.NONE)
        if not (context.up(sender) and context.up(receiver)):
            cause = Cause.NODE_DOWN
        if cause:
            record(frame.end_ns, EventKind.LOSS, packet, sender, receiver, packet.size_bytes, cause)
        return cause

    def _occupy(self, sender: int, duration_ns: int) -> None:
        """Set the time from which a sender may send again, for a frame that begins now."""
        until_ns = int(self._env.now) + PERIODS_PER_AIRTIME * duration_ns
        if sender != self._gateway:
            until_ns += int(self._context.rng.uniform(0.0, JITTER_AIRTIMES * duration_ns))
        self._free_ns[sender] = until_ns

    def _deliver(self, packet: Packet, sender: int, receiver: int) -> None:
        now_ns = int(self._env.now)
        record = self._context.recorder.add_packet
        record(now_ns, EventKind.DELIVER, packet, sender, receiver, packet.size_bytes)
        self._context.receive(packet, receiver)

    def _acknowledge(
        self, packet: Packet, sender: int, receiver: int, cause: Cause
    ) -> Generator[simpy.Event, Any, bool]:
        """Answer an uplink that ends now in its first receive window; returns whether its sender hears it.

        Args:
            packet: the packet of the uplink.
            sender: its sender.
            receiver: the gateway.
            cause: why the gateway has not received it, or ``NONE``.
        """
        context, record = self._context, self._context.recorder.add_packet
        yield self._env.timeout(RECEIVE_DELAY_NS)
        if cause:
            return False
        now_ns = int(self._env.now)
        duration_ns = airtime_ns(ACK_BYTES, self._spreading_factor, False)
        heard = False
        if now_ns >= self._free_ns.get(receiver, 0):
            self._occupy(receiver, duration_ns)
            record(now_ns, EventKind.ACK, packet, receiver, sender, ACK_BYTES, duration_ns=duration_ns)
            frame = self._medium.start(receiver, duration_ns, sender, ACK_BYTES, "lora")
            yield self._env.timeout(duration_ns)
            heard = not self._medium.finish(frame) and context.up(sender)
        if not heard:
            now_ns = int(self._env.now)
            record(now_ns, EventKind.LOSS, packet, sender, receiver, packet.size_bytes, Cause.ACK_LOST)
        return heard

    def _enqueue(self, packet: Packet, node: int) -> None:
        """Keep a downlink for the node's next receive window; it replaces one that still waits."""
        older = self._waiting.pop(node, None)
        self._waiting[node] = packet
        if older is not None:
            self._fail(older, node, Cause.BUFFER)
        self._env.process(self._expire(packet, node))

    def _expire(self, packet: Packet, node: int) -> Generator[simpy.Event, Any, None]:
        yield self._env.timeout(self._lifetime_ns)
        if self._waiting.get(node) is packet:
            del self._waiting[node]
            self._fail(packet, node, Cause.DEADLINE)

    def _fail(self, packet: Packet, node: int, cause: Cause) -> None:
        self._context.report(packet, self._gateway, node, Delivery(False, cause, 0))

    def _open_window(self, node: int) -> Generator[simpy.Event, Any, None]:
        """Send the node's downlink, if there is one, in the window after an uplink that ends now."""
        yield self._env.timeout(RECEIVE_DELAY_NS)
        if node not in self._waiting or self._env.now < self._free_ns.get(self._gateway, 0):
            return
        packet = self._waiting.pop(node)
        cause = yield from self._transmit(packet, self._gateway, node, False)
        if not cause:
            self._deliver(packet, self._gateway, node)
        self._context.report(packet, self._gateway, node, Delivery(True, cause, 1))
