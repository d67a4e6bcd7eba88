"""IEEE 802.11's distributed coordination function with several packets in a frame (A-MPDU, SPEC 6.3).

A station's packets wait until it may send. Then as many as fit go out in one frame, and a block
acknowledgement says which of them arrived; the others are sent again, in the next frame, with what has come
since. The packets of a frame are within one window: none is sent that is ``most_packets`` or more after the
first one that is not acknowledged. Left out: an acknowledgement that is lost is not asked for again, its
packets are; the receiver hands on packets as they come, where the standard restores their order.
"""

from __future__ import annotations

from collections.abc import Generator, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import simpy

from network_sim.mac.contention import Contention, Station
from network_sim.mac.context import MacContext
from network_sim.mac.phy import DELIMITER_BYTES, PhysicalLayer
from network_sim.types import Cause, Delivery, EventKind, Packet

if TYPE_CHECKING:
    from network_sim.mac.medium import Transmission

_AIR, _DELIVER, _LOSS, _NONE = EventKind.AIR, EventKind.DELIVER, EventKind.LOSS, Cause.NONE


@dataclass(slots=True, eq=False)
class _Waiting:
    """A packet that waits for its acknowledgement."""

    packet: Packet
    receiver: int
    number: int
    """Sequence number among the packets to this receiver."""
    attempts: int = 0
    arrived: bool = False
    acknowledged: bool = False


@dataclass(slots=True, eq=False)
class _Queue:
    """What one node has to send."""

    node: int
    waiting: list[_Waiting] = field(default_factory=list)
    """Packets in the order of their numbers."""
    numbers: dict[int, int] = field(default_factory=dict)
    """Number of the next packet to each receiver."""
    idle: simpy.Event | None = None
    """Succeeds when there is something to send; None if there is."""
    full: simpy.Event | None = None
    """Succeeds when there is room for a packet; None if nobody waits for it."""


class Aggregating(Contention):
    """Medium access of all stations of one channel, which send several packets in a frame."""

    def __init__(self, context: MacContext, layer: PhysicalLayer, wait_after_loss: bool = True) -> None:
        """Create a medium access as ``Contention`` does, for a physical layer with aggregation."""
        super().__init__(context, layer, wait_after_loss)
        limits = layer.aggregation
        assert limits is not None
        self._report = context.report
        self._most_packets = limits.most_packets
        self._most_bytes = min(limits.most_bytes, layer.data.most_bytes(limits.most_ns))
        self._queues: dict[int, _Queue] = {}

    def send(self, packet: Packet, sender: int, receiver: int) -> Generator[simpy.Event, Any, Delivery]:
        """Carry a packet to a neighbour: ``delivery = yield from mac.send(packet, a, b)``.

        Returns:
            As soon as the packet waits among at most ``most_packets``; it is then ``under_way``, and its
            outcome is reported: ``ok`` when an acknowledgement came; ``ACK_LOST`` for a packet that was
            dropped after it had arrived.
        """
        queue = self._queues.get(sender)
        if queue is None:
            queue = self._queues[sender] = _Queue(sender)
            self._env.process(self._run(queue))
        while len(queue.waiting) >= self._most_packets:
            queue.full = self._env.event()
            yield queue.full
        if not self._up(sender):
            return Delivery(False, Cause.NODE_DOWN, 0)
        number = queue.numbers.get(receiver, 0)
        queue.numbers[receiver] = number + 1
        queue.waiting.append(_Waiting(packet, receiver, number))
        if queue.idle is not None:
            queue.idle.succeed()
            queue.idle = None
        return Delivery(True, _NONE, 0, under_way=True)

    def _run(self, queue: _Queue) -> Generator[simpy.Event, Any, None]:
        """Send what waits at a node, as a process."""
        station, window = self._station(queue.node), self._min_window
        while True:
            if not queue.waiting:
                queue.idle = self._env.event()
                yield queue.idle
            yield self._env.timeout(0)  # packets that are handed over at this instant join the frame
            frame = self._next_frame(queue)
            turn = self._contend(station, self._layer.frame_ns([one.packet.size_bytes for one in frame]))
            if turn is not None:
                yield turn
                frame = self._next_frame(queue)
            if not self._up(queue.node):
                self._unsubscribe(station)
                self._schedule()
                window = self._min_window
                self._give_up(queue)
                continue
            answered = yield from self._exchange(station, frame)
            over = answered or any(one.attempts >= self._attempts for one in frame)
            window = self._min_window if over else min(2 * window, self._max_window)
            self._begin_backoff(station, window)
            self._settle(queue, frame)

    def _next_frame(self, queue: _Queue) -> list[_Waiting]:
        """Return the packets of the next frame: to one receiver, within the window and the frame's limits."""
        first, header_bytes = queue.waiting[0], self._layer.header_bytes
        frame: list[_Waiting] = []
        total_bytes = 0
        for one in queue.waiting:
            if one.receiver != first.receiver:
                continue
            size_bytes = DELIMITER_BYTES + header_bytes + one.packet.size_bytes
            over = (
                total_bytes + size_bytes > self._most_bytes or one.number - first.number >= self._most_packets
            )
            if frame and (over or len(frame) >= self._most_packets):
                break
            frame.append(one)
            total_bytes += -(-size_bytes // 4) * 4
        return frame

    def _exchange(self, station: Station, frame: Sequence[_Waiting]) -> Generator[simpy.Event, Any, bool]:
        """Send a frame once; marks what arrived and what was acknowledged. Returns whether an answer came."""
        layer, sender, receiver = self._layer, station.node, frame[0].receiver
        parts_bytes = layer.subframes_bytes([one.packet.size_bytes for one in frame])
        frame_ns = layer.data.air_ns(sum(parts_bytes))
        answer = layer.answer(len(frame))
        cts, begins_ns, rest_ns = None, station.begins_ns, self._gap_ns + answer.duration_ns
        for one in frame:
            one.attempts += 1
        if self._rts:
            first = frame[0].packet
            cts, cause = yield from self._reserve(first, station, receiver, self._gap_ns + frame_ns + rest_ns)
            if cts is None:
                self._lose(frame, sender, cause)
                return False
            begins_ns = cts.end_ns + self._gap_ns
        on_air = self._start_frame(
            layer.data.modulation, sender, receiver, sum(parts_bytes), begins_ns, frame_ns, rest_ns, cts
        )
        instants_ns = self._record_air(frame, parts_bytes, on_air)
        yield self._env.timeout(on_air.end_ns - self._env.now)
        arrived = self._arrivals(frame, parts_bytes, instants_ns, on_air)
        if not arrived:
            self._end_failed(station, on_air, self._reply_wait_ns)
            return False
        reply = self._start_answer(answer, arrived[0].packet, on_air)
        yield self._env.timeout(rest_ns)
        if self._outcome(reply):
            self._end_failed(station, reply, 0)
            self._lose(arrived, sender, Cause.ACK_LOST)
            return False
        self._end_well(station, reply)
        for one in arrived:
            one.acknowledged = True
        return True

    def _record_air(
        self, frame: Sequence[_Waiting], parts_bytes: Sequence[int], on_air: Transmission
    ) -> list[int]:
        """Record each packet for its share of the frame; returns the instants (ns) that divide it, ends
        included."""
        data_ns = on_air.start_ns + self._layer.data.preamble_ns
        total_bytes, sent_bytes, instants_ns = sum(parts_bytes), 0, [on_air.start_ns]
        for one, part_bytes in zip(frame, parts_bytes, strict=True):
            sent_bytes += part_bytes
            instants_ns.append(data_ns + (on_air.end_ns - data_ns) * sent_bytes // total_bytes)
            begins_ns, ends = instants_ns[-2], (on_air.sender, on_air.receiver)
            self._record(begins_ns, _AIR, one.packet, *ends, part_bytes, _NONE, instants_ns[-1] - begins_ns)
        if self._counting:
            self._schedule()
        return instants_ns

    def _arrivals(
        self,
        frame: Sequence[_Waiting],
        parts_bytes: Sequence[int],
        instants_ns: Sequence[int],
        on_air: Transmission,
    ) -> list[_Waiting]:
        """Hand on the packets of a frame that arrived, record those that did not, and return the former."""
        sender, receiver, arrived = on_air.sender, on_air.receiver, []
        preamble_ns = self._layer.data.preamble_ns
        causes = self._medium.outcomes(on_air, preamble_ns, instants_ns, parts_bytes)
        down = not (self._up(sender) and self._up(receiver))
        for one, cause in zip(frame, causes, strict=True):
            lost = self._lost(sender, receiver)
            why = Cause.NODE_DOWN if down else cause or (Cause.LINK if lost else _NONE)
            if why:
                self._lose([one], sender, why)
                continue
            arrived.append(one)
            if not one.arrived:
                one.arrived = True
                size_bytes = one.packet.size_bytes
                self._record(on_air.end_ns, _DELIVER, one.packet, sender, receiver, size_bytes)
                self._receive(one.packet, receiver)
        return arrived

    def _lose(self, packets: Sequence[_Waiting], sender: int, cause: Cause) -> None:
        """Record attempts that failed now."""
        now_ns = int(self._env.now)
        for one in packets:
            self._record(now_ns, _LOSS, one.packet, sender, one.receiver, one.packet.size_bytes, cause)

    def _settle(self, queue: _Queue, frame: Sequence[_Waiting]) -> None:
        """Report the packets of a frame that are acknowledged, or were sent as often as is allowed."""
        over = [one for one in frame if one.acknowledged or one.attempts >= self._attempts]
        closed = set(map(id, over))
        queue.waiting = [one for one in queue.waiting if id(one) not in closed]
        for one in over:
            failed = Cause.ACK_LOST if one.arrived else Cause.RETRIES
            self._hand_back(queue, one, one.acknowledged, _NONE if one.acknowledged else failed)

    def _give_up(self, queue: _Queue) -> None:
        """Report all packets of a node that is down, the last one first: the node's buffer takes them
        back."""
        waiting, queue.waiting = queue.waiting, []
        for one in reversed(waiting):
            self._hand_back(queue, one, False, Cause.ACK_LOST if one.arrived else Cause.NODE_DOWN)

    def _hand_back(self, queue: _Queue, one: _Waiting, ok: bool, cause: Cause) -> None:
        self._report(one.packet, queue.node, one.receiver, Delivery(ok, cause, one.attempts))
        if queue.full is not None:
            queue.full.succeed()
            queue.full = None
