"""IEEE 802.11b distributed coordination function at 11 Mb/s (SPEC 6.3), with or without RTS/CTS.

Contention is resolved per transmission, not per slot: a station knows when its countdown would end, and a
busy channel freezes what is left of it. One timer runs for the countdown that ends first, an overtaken one
does nothing, and a countdown that nothing can disturb is not waited for. An answer is put on the air when the
frame that it answers ends, to start a SIFS later: nobody is told that the channel is idle between them.
"""

from __future__ import annotations

from collections.abc import Callable, Generator
from typing import TYPE_CHECKING, Any

import simpy

from network_sim.mac.context import MacContext
from network_sim.mac.random_blocks import numbers_below
from network_sim.types import Cause, Delivery, EventKind, Packet

if TYPE_CHECKING:
    from network_sim.mac.medium import Listener, Transmission

SLOT_NS = 20_000
SIFS_NS = 10_000
DIFS_NS = SIFS_NS + 2 * SLOT_NS
PLCP_NS = 192_000
"""Long preamble and PLCP header."""
PROPAGATION_NS = 1_000
"""Bianchi's delay from one station to another; a sender waits twice as long for an answer."""
GAP_NS = SIFS_NS + 2 * PROPAGATION_NS
"""Between a frame and its answer."""
HEADER_BYTES = 28 + 8
"""MAC header with check sum, and LLC/SNAP."""
ACK_BYTES = 14
RTS_BYTES = 20
ACK_NS = PLCP_NS + 8 * ACK_BYTES * 1000 // 2
"""Acknowledgements and CTS of the same size are sent at 2 Mb/s."""
RTS_NS = PLCP_NS + 8 * RTS_BYTES * 1000 // 2
EIFS_NS = SIFS_NS + PLCP_NS + 8 * ACK_BYTES * 1000 + DIFS_NS
"""Silence after a frame that could not be read: its answer may be on the air, at 1 Mb/s."""
ANSWER_WAIT_NS = GAP_NS + SLOT_NS + PLCP_NS
"""From the end of a frame until its sender takes it for lost; a DIFS and the next countdown follow."""
MIN_WINDOW = 32
MAX_WINDOW = 1024
ATTEMPTS = 7
"""Frames, or RTS, for a packet before it is given up."""

_NEVER = 2**62
_AIR, _ACK, _DELIVER, _NONE = EventKind.AIR, EventKind.ACK, EventKind.DELIVER, Cause.NONE
"""An enumeration is slow to look up, and these are for every packet."""
_AT_ONCE = Delivery(True, Cause.NONE, 1)


def data_ns(size_bytes: int) -> int:
    """Time on the air of a data frame.

    Args:
        size_bytes: What the medium access carries: application bytes with UDP and IP headers.
    """
    return PLCP_NS + (8 * (size_bytes + HEADER_BYTES) * 1000 + 5) // 11


class _Station:
    """What one node knows of the channel and of its own countdown.

    Three states: it counts (``from_ns`` is set), it is frozen by a busy channel, or it is sending. Without a
    packet only the backoff after the last one goes on; when that is over it leaves the channel.
    """

    __slots__ = (
        "_counting",
        "_eifs_ns",
        "_leave",
        "answer_ns",
        "arrived",
        "begins_ns",
        "event",
        "free_ns",
        "from_ns",
        "listener",
        "node",
        "reserved_ns",
        "sending",
        "slots",
    )

    def __init__(
        self,
        node: int,
        counting: dict[int, _Station],
        leave: Callable[[_Station], None],
        eifs_ns: int,
    ) -> None:
        """``counting`` has the stations with a packet that are not frozen; ``leave`` ends a subscription."""
        self.node = node
        self._counting = counting
        self._leave = leave
        self._eifs_ns = eifs_ns
        self.listener: Listener | None = None
        """Its subscription to the channel; None when there is nothing to count."""
        self.event: simpy.Event | None = None
        """Succeeds when it may send; None without a packet."""
        self.slots = 0
        """Left to count."""
        self.begins_ns = 0
        """When its next frame begins, once that is certain."""
        self.from_ns = _NEVER
        """From when it counts; never while frozen."""
        self.free_ns = 0
        """End of the interframe space after what it heard last."""
        self.reserved_ns = -DIFS_NS
        """Until when frames that it has read asked for silence (NAV)."""
        self.answer_ns = 0
        """The same after what it sent last, with the time that it waits for an answer."""
        self.sending = False
        self.arrived = False
        """Its packet has reached the receiver, whether or not it knows."""

    @property
    def expiry_ns(self) -> int:
        """When the countdown ends if nothing freezes it."""
        return self.from_ns + self.slots * SLOT_NS

    def on_busy(self, now_ns: int) -> None:
        """Freeze, unless the countdown is over: then it sends in this very instant, and they collide."""
        from_ns = self.from_ns
        if from_ns == _NEVER:
            return
        if from_ns + self.slots * SLOT_NS <= now_ns:
            if self.event is None:
                self._leave(self)
            return
        if now_ns > from_ns:
            self.slots -= (now_ns - from_ns) // SLOT_NS
        self.from_ns = _NEVER
        self._counting.pop(self.node, None)

    def on_idle(self, free_ns: int, damaged: bool) -> None:
        """Count on after the interframe space."""
        self.hear(free_ns, damaged)
        if not self.sending:
            self.count_on()

    def hear(self, free_ns: int, damaged: bool) -> None:
        """Take in what the last frame says of the channel; a longer reservation than its own stays valid."""
        if damaged:
            self.free_ns = max(free_ns + self._eifs_ns, self.reserved_ns + DIFS_NS)
        else:
            if free_ns > self.reserved_ns:
                self.reserved_ns = free_ns
            self.free_ns = self.reserved_ns + DIFS_NS

    def count_on(self) -> None:
        """Count as soon as both interframe spaces are over."""
        self.from_ns = self.free_ns if self.free_ns > self.answer_ns else self.answer_ns
        if self.event is not None:
            self._counting[self.node] = self


class Dcf:
    """Medium access of all stations of one channel."""

    def __init__(self, context: MacContext, wait_after_loss: bool = True) -> None:
        """Stations that have heard and sent nothing yet.

        Args:
            context: Clock, channel and nodes; ``config.mac.rts`` says whether to use RTS/CTS.
            wait_after_loss: Follow the standard: an EIFS after damaged frames, and a sender waits for the
                answer that does not come. False waits a DIFS only, as Bianchi's model assumes.
        """
        self._env = context.env
        self._medium = context.medium
        self._rts = context.config.mac.rts
        self._record = context.recorder.add_packet
        self._up = context.up
        self._receive = context.receive
        self._eifs_ns = EIFS_NS if wait_after_loss else DIFS_NS
        self._answer_wait_ns = ANSWER_WAIT_NS if wait_after_loss else 0
        self._stations: dict[int, _Station] = {}
        self._counting: dict[int, _Station] = {}
        self._resting: dict[int, _Station] = {}
        self._timer_ns = _NEVER
        self._numbers = numbers_below(MAX_WINDOW, context.rng)

    def send(self, packet: Packet, sender: int, receiver: int) -> Generator[simpy.Event, Any, Delivery]:
        """Carry a packet to a neighbour: ``delivery = yield from mac.send(packet, a, b)``.

        Returns:
            ``ok`` when an acknowledgement came; a packet that was given up after it had arrived has
            ``ACK_LOST``.
        """
        station = self._stations.get(sender)
        if station is None:
            station = self._stations[sender] = _Station(sender, self._counting, self._leave, self._eifs_ns)
        station.arrived = False
        window = MIN_WINDOW
        for attempt in range(1, ATTEMPTS + 1):
            turn = self._compete(station, packet.size_bytes)
            if turn is not None:
                yield turn
            if not self._up(sender):
                self._leave(station)
                self._schedule()
                return Delivery(False, Cause.ACK_LOST if station.arrived else Cause.NODE_DOWN, attempt - 1)
            cause = yield from self._exchange(packet, station, receiver)
            over = not cause or attempt == ATTEMPTS
            window = MIN_WINDOW if over else min(2 * window, MAX_WINDOW)
            self._rest(station, window)
            if not cause:
                return _AT_ONCE if attempt == 1 else Delivery(True, _NONE, attempt)
        yield self._env.timeout(station.answer_ns - DIFS_NS - self._env.now)
        return Delivery(False, Cause.ACK_LOST if station.arrived else Cause.RETRIES, ATTEMPTS)

    def _compete(self, station: _Station, size_bytes: int) -> simpy.Event | None:
        """What succeeds when the station may send; None if nothing can happen before its frame is over."""
        env = self._env
        now_ns = int(env.now)
        self._resting.pop(station.node, None)
        for other in tuple(self._resting.values()):
            if other.expiry_ns <= now_ns:
                self._leave(other)
        if station.listener is None:
            self._join(station, now_ns)
        if station.from_ns != _NEVER:
            begins_ns = station.expiry_ns
            if begins_ns < now_ns:
                station.from_ns, station.slots = now_ns, 0
                begins_ns = now_ns
            first_ns = RTS_NS if self._rts else data_ns(size_bytes)
            if self._medium.alone and env.peek() > begins_ns + first_ns:
                station.begins_ns, station.from_ns, station.sending = begins_ns, _NEVER, True
                return None
            self._counting[station.node] = station
            self._schedule()
        station.event = env.event()
        return station.event

    def _join(self, station: _Station, now_ns: int) -> None:
        """Listen to the channel; a station that finds it idle for long enough need not count."""
        medium, node = self._medium, station.node
        listener = station.listener = medium.subscribe(node, station.on_busy, station.on_idle)
        station.hear(*medium.last_heard(node))
        station.slots = 0
        if listener.busy or station.free_ns > now_ns:
            station.slots = next(self._numbers) & (MIN_WINDOW - 1)
        if not listener.busy:
            station.from_ns = max(station.free_ns, station.answer_ns, now_ns)

    def _leave(self, station: _Station) -> None:
        """Listen no longer: there is nothing to send and nothing to count."""
        self._medium.unsubscribe(station.node)
        self._resting.pop(station.node, None)
        station.listener, station.from_ns, station.sending = None, _NEVER, False

    def _rest(self, station: _Station, window: int) -> None:
        """Draw the next backoff, which goes on with or without another packet."""
        station.slots = next(self._numbers) & (window - 1)
        station.sending = False
        self._resting[station.node] = station
        if station.listener is not None and not station.listener.busy:
            station.count_on()
        self._schedule()

    def _schedule(self) -> None:
        """Set the timer to the countdown that ends first."""
        if not self._counting:
            return
        first_ns = min([station.from_ns + station.slots * SLOT_NS for station in self._counting.values()])
        if first_ns < self._timer_ns:
            self._timer_ns = first_ns
            timer = self._env.timeout(first_ns - self._env.now)
            timer.callbacks.append(self._fire)

    def _fire(self, _: simpy.Event) -> None:
        """Let everyone send whose countdown ends now."""
        now_ns = int(self._env.now)
        if now_ns != self._timer_ns:
            return
        self._timer_ns = _NEVER
        winners = [station for station in self._counting.values() if station.expiry_ns == now_ns]
        for station in winners:
            del self._counting[station.node]
            station.begins_ns, station.from_ns, station.sending = now_ns, _NEVER, True
            event, station.event = station.event, None
            if event is not None:
                event.succeed()
        if not winners:
            self._schedule()

    def _exchange(
        self, packet: Packet, station: _Station, receiver: int
    ) -> Generator[simpy.Event, Any, Cause]:
        """One attempt; returns ``NONE`` when the sender has the acknowledgement."""
        env, sender, size_bytes = self._env, station.node, packet.size_bytes
        clearance, begins_ns = None, station.begins_ns
        if self._rts:
            clearance = yield from self._ask(packet, station, receiver)
            if clearance is None:
                return Cause.COLLISION
            begins_ns = clearance.end_ns + GAP_NS
        duration_ns, frame_bytes = data_ns(size_bytes), size_bytes + HEADER_BYTES
        rest_ns = GAP_NS + ACK_NS
        frame = self._put(
            _AIR, packet, sender, receiver, frame_bytes, begins_ns, duration_ns, rest_ns, clearance
        )
        yield env.timeout(frame.end_ns - env.now)
        cause = self._outcome(frame)
        if cause:
            self._lose(packet, station, frame, cause, self._answer_wait_ns)
            return cause
        if not station.arrived:
            station.arrived = True
            self._record(frame.end_ns, _DELIVER, packet, sender, receiver, size_bytes)
            self._receive(packet, receiver)
        begins_ns = frame.end_ns + GAP_NS
        answer = self._put(_ACK, packet, receiver, sender, ACK_BYTES, begins_ns, ACK_NS, 0, frame)
        yield env.timeout(rest_ns)
        if self._outcome(answer):
            self._lose(packet, station, answer, Cause.ACK_LOST, 0)
            return Cause.ACK_LOST
        self._medium.clear(answer)
        station.answer_ns = answer.end_ns + DIFS_NS
        return _NONE

    def _ask(
        self, packet: Packet, station: _Station, receiver: int
    ) -> Generator[simpy.Event, Any, Transmission | None]:
        """RTS and CTS; returns the CTS, after which the data frame has to be sent, or None."""
        sender, begins_ns, rest_ns = station.node, station.begins_ns, GAP_NS + ACK_NS + GAP_NS
        request = self._put(_ACK, packet, sender, receiver, RTS_BYTES, begins_ns, RTS_NS, rest_ns, None)
        yield self._env.timeout(request.end_ns - self._env.now)
        cause = self._outcome(request)
        if cause:
            self._lose(packet, station, request, cause, self._answer_wait_ns)
            return None
        begins_ns = request.end_ns + GAP_NS
        rest_ns = GAP_NS + data_ns(packet.size_bytes) + GAP_NS + ACK_NS
        clearance = self._put(_ACK, packet, receiver, sender, ACK_BYTES, begins_ns, ACK_NS, rest_ns, request)
        yield self._env.timeout(GAP_NS + ACK_NS)
        cause = self._outcome(clearance)
        if cause:
            self._lose(packet, station, clearance, cause, 0)
            return None
        return clearance

    def _put(
        self,
        kind: EventKind,
        packet: Packet,
        sender: int,
        receiver: int,
        size_bytes: int,
        begins_ns: int,
        duration_ns: int,
        reserve_ns: int,
        answered: Transmission | None,
    ) -> Transmission:
        """Put a frame on the air; the one that it answers ends now."""
        frame = self._medium.start(sender, duration_ns, receiver, size_bytes, "cck", begins_ns, reserve_ns)
        if answered is not None:
            self._medium.clear(answered)
        self._record(begins_ns, kind, packet, sender, receiver, size_bytes, _NONE, duration_ns)
        if self._counting:
            self._schedule()
        return frame

    def _outcome(self, frame: Transmission) -> Cause:
        """Why a frame that ends now did not arrive."""
        cause = self._medium.outcome(frame)
        if not (self._up(frame.sender) and self._up(frame.receiver)):
            return Cause.NODE_DOWN
        return cause

    def _lose(
        self, packet: Packet, station: _Station, frame: Transmission, cause: Cause, wait_ns: int
    ) -> None:
        """An attempt ends with this frame; the sender waits for an answer until it knows."""
        now_ns = frame.end_ns
        self._medium.clear(frame)
        receiver = frame.receiver if frame.sender == station.node else frame.sender
        self._record(now_ns, EventKind.LOSS, packet, station.node, receiver, packet.size_bytes, cause)
        station.answer_ns = now_ns + wait_ns + DIFS_NS
