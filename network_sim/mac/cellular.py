"""Uplink of cellular modules: a base station grants transport blocks, and repeats them by HARQ.

The sink is the base station, which covers every node, and one packet is one transport block. A node that has
nothing to send needs a request before its first grant; after that the base station knows its buffer. Blocks
begin on subframes of 1 ms. A block that is lost (``loss.share``) is granted again. Left out: random access,
discontinuous reception, repetitions for bad coverage, the gain of combining two receptions, and the
subframes that synchronisation and system information take from the grants.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Generator
from dataclasses import dataclass, field
from typing import Any

import simpy

from network_sim.mac.context import MacContext
from network_sim.radio.losses import LinkLosses
from network_sim.types import Cause, Delivery, EventKind, Packet

SUBFRAME_NS = 1_000_000
MAX_RETRIES = 4
"""A block is sent five times (maxHARQ-Tx n5 of the default configuration, 3GPP TS 36.331, 9.2.2)."""


@dataclass(frozen=True, slots=True)
class Carrier:
    """What the base station can grant, and when."""

    block_ns: Callable[[int], int]
    """Returns the time on the air of a block of so many bytes."""
    header_bytes: int
    """Bytes of MAC, RLC and PDCP in a block."""
    lanes: int
    """Blocks of different nodes that can be on the air at once."""
    burst_blocks: int
    """Blocks that a node may send one after the other."""
    gap_ns: int
    """Time from the end of a node's burst to its next one."""
    repeat_ns: int
    """Time from the end of a block that was lost until it can be repeated."""
    request_ns: int
    """Time from a node's first packet to the block that carries it."""


@dataclass(slots=True, eq=False)
class _Block:
    packet: Packet
    receiver: int
    ready_ns: int
    """Earliest time at which it can be sent."""
    granted: simpy.Event | None
    """Event that triggers when it is sent first (True), or when its node is down (False); None afterwards."""
    attempts: int = 0


@dataclass(slots=True, eq=False)
class _Flow:
    """What one node has to send."""

    node: int
    blocks: list[_Block] = field(default_factory=list)
    """Blocks that are not on the air, those to be repeated first."""
    burst_left: int = 0
    begun_ns: int = -1
    """Time at which its last block began."""
    end_ns: int = -(10**18)
    """Time at which its last block ends."""


class Cellular:
    """Medium access of all nodes in one cell, which share a carrier."""

    def __init__(self, context: MacContext, carrier: Carrier) -> None:
        """Create the medium access; the carrier has the timing of the standard."""
        config = context.config
        self._context, self._env, self._carrier = context, context.env, carrier
        self._lost = LinkLosses(config.loss, config.run.seed).lost
        self._attempts = 1 + (MAX_RETRIES if config.mac.retries is None else config.mac.retries)
        self._flows: dict[int, _Flow] = {}
        self._free_ns = [0] * carrier.lanes
        """Time at which each lane's block ends."""
        self._begun_ns = -SUBFRAME_NS
        """Time of the last grant: one block begins in a subframe."""
        self._timer_ns: float = math.inf

    def send(self, packet: Packet, sender: int, receiver: int) -> Generator[simpy.Event, Any, Delivery]:
        """Carry a packet to a neighbour: ``delivery = yield from mac.send(packet, a, b)``.

        Returns:
            When the block begins; the packet is then ``under_way``, and its outcome is reported.
        """
        env = self._env
        if not self._context.up(sender):
            return Delivery(False, Cause.NODE_DOWN, 0)
        flow = self._flows.get(sender)
        if flow is None:
            flow = self._flows[sender] = _Flow(sender)
        now_ns = int(env.now)
        known = flow.begun_ns == now_ns or flow.blocks
        block = _Block(packet, receiver, now_ns + (0 if known else self._carrier.request_ns), env.event())
        flow.blocks.append(block)
        self._schedule()
        assert block.granted is not None
        if not (yield block.granted):
            return Delivery(False, Cause.NODE_DOWN, 0)
        return Delivery(True, Cause.NONE, 1, under_way=True)

    def _begins_ns(self, flow: _Flow) -> int:
        """Return the first subframe in which a block of this flow can begin."""
        ready_ns = min(block.ready_ns for block in flow.blocks)
        at_ns = max(ready_ns, min(self._free_ns), self._begun_ns + SUBFRAME_NS, int(self._env.now))
        at_ns = -(-at_ns // SUBFRAME_NS) * SUBFRAME_NS
        if flow.burst_left and at_ns <= flow.end_ns:
            return flow.end_ns
        return max(at_ns, flow.end_ns + self._carrier.gap_ns)

    def _schedule(self) -> None:
        """Set the timer to the next block of all nodes."""
        first_ns = min((self._begins_ns(flow) for flow in self._flows.values() if flow.blocks), default=None)
        if first_ns is not None and first_ns < self._timer_ns:
            self._timer_ns = first_ns
            timer = self._env.timeout(first_ns - self._env.now)
            timer.callbacks.append(self._fire)

    def _fire(self, _: simpy.Event) -> None:
        """Let one node send a block now: one in the middle of a burst, else the one that waited longest."""
        now_ns = int(self._env.now)
        if now_ns != self._timer_ns:
            return
        self._timer_ns = math.inf
        flows = [flow for flow in self._flows.values() if flow.blocks and self._begins_ns(flow) == now_ns]
        flow = min(
            flows,
            key=lambda one: (not self._continues(one, now_ns), one.begun_ns, one.node),
        )
        if self._context.up(flow.node):
            self._begin(flow)
        else:
            self._give_up(flow)
        self._schedule()

    def _continues(self, flow: _Flow, now_ns: int) -> bool:
        return flow.burst_left > 0 and flow.end_ns == now_ns

    def _begin(self, flow: _Flow) -> None:
        """Put the flow's first block that is ready on the air."""
        now_ns, carrier = int(self._env.now), self._carrier
        block = next(one for one in flow.blocks if one.ready_ns <= now_ns)
        flow.blocks.remove(block)
        size_bytes = block.packet.size_bytes + carrier.header_bytes
        duration_ns = carrier.block_ns(size_bytes)
        flow.burst_left = (flow.burst_left if self._continues(flow, now_ns) else carrier.burst_blocks) - 1
        flow.begun_ns, flow.end_ns = now_ns, now_ns + duration_ns
        self._begun_ns = now_ns
        self._free_ns[self._free_ns.index(min(self._free_ns))] = flow.end_ns
        block.attempts += 1
        self._context.recorder.add_packet(
            now_ns,
            EventKind.AIR,
            block.packet,
            flow.node,
            block.receiver,
            size_bytes,
            duration_ns=duration_ns,
        )
        if block.granted is not None:
            block.granted.succeed(True)
            block.granted = None
        self._env.process(self._carry(block, flow, duration_ns))

    def _give_up(self, flow: _Flow) -> None:
        """Return all blocks of a node that is down."""
        blocks, flow.blocks = flow.blocks, []
        for block in blocks:
            if block.granted is not None:
                block.granted.succeed(False)
            else:
                self._report(block, flow, Delivery(False, Cause.NODE_DOWN, block.attempts))

    def _carry(self, block: _Block, flow: _Flow, duration_ns: int) -> Generator[simpy.Event, Any, None]:
        """Deliver a block at its end, or have it repeated."""
        context, packet, node, receiver = self._context, block.packet, flow.node, block.receiver
        yield self._env.timeout(duration_ns)
        now_ns = int(self._env.now)
        cause = Cause.LINK if self._lost(node, receiver) else Cause.NONE
        if not (context.up(node) and context.up(receiver)):
            cause = Cause.NODE_DOWN
        kind = EventKind.LOSS if cause else EventKind.DELIVER
        context.recorder.add_packet(now_ns, kind, packet, node, receiver, packet.size_bytes, cause)
        if not cause:
            context.receive(packet, receiver)
            self._report(block, flow, Delivery(True, cause, block.attempts))
        elif cause is Cause.NODE_DOWN:
            self._report(block, flow, Delivery(False, cause, block.attempts))
        elif block.attempts == self._attempts:
            self._report(block, flow, Delivery(False, Cause.RETRIES, block.attempts))
        else:
            block.ready_ns = now_ns + self._carrier.repeat_ns
            flow.blocks.insert(0, block)
            self._schedule()

    def _report(self, block: _Block, flow: _Flow, delivery: Delivery) -> None:
        self._context.report(block.packet, flow.node, block.receiver, delivery)
