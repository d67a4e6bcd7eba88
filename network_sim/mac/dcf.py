"""IEEE 802.11's distributed coordination function, one packet in a frame (SPEC 6.3), with or without
RTS/CTS."""

from __future__ import annotations

from collections.abc import Generator
from typing import Any

import simpy

from network_sim.mac.contention import Contention, Station
from network_sim.types import Cause, Delivery, EventKind, Packet

_AIR, _DELIVER, _NONE = EventKind.AIR, EventKind.DELIVER, Cause.NONE
"""Local names, because enumeration members are slow to look up and these are used for every packet."""
_FIRST_ATTEMPT = Delivery(True, Cause.NONE, 1)


class Dcf(Contention):
    """Medium access of all stations of one channel, each of which sends a packet until it is acknowledged."""

    def send(self, packet: Packet, sender: int, receiver: int) -> Generator[simpy.Event, Any, Delivery]:
        """Carry a packet to a neighbour: ``delivery = yield from mac.send(packet, a, b)``.

        Returns:
            ``ok`` when an acknowledgement came; a packet that was dropped after it had arrived has
            ``ACK_LOST``.
        """
        station, arrived = self._station(sender), False
        window, frame_ns = self._min_window, self._layer.data_ns(packet.size_bytes)
        for attempt in range(1, self._attempts + 1):
            turn = self._contend(station, frame_ns)
            if turn is not None:
                yield turn
            if not self._up(sender):
                self._unsubscribe(station)
                self._schedule()
                return Delivery(False, Cause.ACK_LOST if arrived else Cause.NODE_DOWN, attempt - 1)
            cause, arrives = yield from self._exchange(packet, station, receiver, frame_ns, arrived)
            arrived = arrived or arrives
            over = not cause or attempt == self._attempts
            window = self._min_window if over else min(2 * window, self._max_window)
            self._begin_backoff(station, window)
            if not cause:
                return _FIRST_ATTEMPT if attempt == 1 else Delivery(True, _NONE, attempt)
        yield self._env.timeout(station.own_free_ns - self._difs_ns - self._env.now)
        return Delivery(False, Cause.ACK_LOST if arrived else Cause.RETRIES, self._attempts)

    def _exchange(
        self, packet: Packet, station: Station, receiver: int, frame_ns: int, arrived: bool
    ) -> Generator[simpy.Event, Any, tuple[Cause, bool]]:
        """Make one attempt.

        Returns:
            ``NONE`` if acknowledged, else the cause (``COLLISION`` without CTS); and whether the packet
            reached the receiver.
        """
        env, sender, size_bytes, layer = self._env, station.node, packet.size_bytes, self._layer
        cts, begins_ns, rest_ns = None, station.begins_ns, self._gap_ns + layer.ack.duration_ns
        if self._rts:
            cts, cause = yield from self._reserve(
                packet, station, receiver, self._gap_ns + frame_ns + rest_ns
            )
            if cts is None:
                self._lose(packet, station, receiver, cause)
                return Cause.COLLISION, False
            begins_ns = cts.end_ns + self._gap_ns
        frame_bytes = size_bytes + layer.header_bytes
        frame = self._start_frame(
            layer.data.modulation, sender, receiver, frame_bytes, begins_ns, frame_ns, rest_ns, cts
        )
        self._record(begins_ns, _AIR, packet, sender, receiver, frame_bytes, _NONE, frame_ns)
        if self._counting:
            self._schedule()
        yield env.timeout(frame.end_ns - env.now)
        lost = self._lost(sender, receiver)
        cause = self._outcome(frame) or (Cause.LINK if lost else _NONE)
        if cause:
            self._end_failed(station, frame, self._reply_wait_ns)
            self._lose(packet, station, receiver, cause)
            return cause, False
        if not arrived:
            self._record(frame.end_ns, _DELIVER, packet, sender, receiver, size_bytes)
            self._receive(packet, receiver)
        answer = self._start_answer(layer.ack, packet, frame)
        yield env.timeout(rest_ns)
        if self._outcome(answer):
            self._end_failed(station, answer, 0)
            self._lose(packet, station, receiver, Cause.ACK_LOST)
            return Cause.ACK_LOST, True
        self._end_well(station, answer)
        return _NONE, True

    def _lose(self, packet: Packet, station: Station, receiver: int, cause: Cause) -> None:
        """Record the attempt that failed now."""
        now_ns = int(self._env.now)
        self._record(now_ns, EventKind.LOSS, packet, station.node, receiver, packet.size_bytes, cause)
