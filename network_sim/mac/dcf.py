"""IEEE 802.11b distributed coordination function (SPEC 6.3), with or without RTS/CTS.

Contention is resolved per transmission, not per slot: a station knows when its countdown will expire, and a
busy channel freezes the remaining slots. One timer runs for the countdown that expires first; an outdated
timer does nothing, and a countdown that nothing can disturb takes no event. A reply is put on the air at the
end of the frame before it, with a start a SIFS later: no listener sees an idle channel between them.
"""

from __future__ import annotations

from collections.abc import Callable, Generator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import simpy

from network_sim.mac.context import MacContext, random_below
from network_sim.radio.losses import LinkLosses
from network_sim.radio.propagation import IEEE80211B
from network_sim.types import Cause, Delivery, EventKind, Packet

if TYPE_CHECKING:
    from network_sim.mac.medium import Listener, Transmission

SLOT_NS = 20_000
SIFS_NS = 10_000
DIFS_NS = SIFS_NS + 2 * SLOT_NS
PLCP_NS = 192_000
"""Long preamble and PLCP header."""
PROPAGATION_NS = 1_000
"""Bianchi's propagation delay between two stations; frame and reply together take twice as long."""
GAP_NS = SIFS_NS + 2 * PROPAGATION_NS
"""Time between a frame and its reply."""
HEADER_BYTES = 28 + 8
"""Size of the MAC header with check sum, and of LLC/SNAP."""
ACK_BYTES = 14
RTS_BYTES = 20
FASTEST_BPS = 11e6
CONTROL_BPS = 2e6
"""Rate of acknowledgements, RTS and CTS, except in a network of 1 Mb/s, which sends these at 1 Mb/s too."""
EIFS_NS = SIFS_NS + PLCP_NS + 8 * ACK_BYTES * 1000 + DIFS_NS
"""Silence after a damaged frame: its acknowledgement may be on the air, at 1 Mb/s."""
REPLY_WAIT_NS = GAP_NS + SLOT_NS + PLCP_NS
"""Time from the end of a frame until its sender counts it as lost; a DIFS and a countdown follow."""
MIN_WINDOW = 32
MAX_WINDOW = 1024
ATTEMPTS = 7
"""Attempts (data frames, or RTS) per packet before it is dropped, if ``mac.retries`` is None."""

_NEVER = 2**62
_AIR, _ACK, _DELIVER, _NONE = EventKind.AIR, EventKind.ACK, EventKind.DELIVER, Cause.NONE
"""Local names, because enumeration members are slow to look up and these are used for every packet."""
_FIRST_ATTEMPT = Delivery(True, Cause.NONE, 1)


def air_ns(frame_bytes: int, rate_bps: float) -> int:
    """Return the time on the air of a frame, preamble included."""
    return PLCP_NS + round(8e9 * frame_bytes / rate_bps)


def data_ns(size_bytes: int, rate_bps: float = FASTEST_BPS) -> int:
    """Return the time on the air of a data frame.

    Args:
        size_bytes: payload of the medium access: application bytes with UDP and IP headers.
        rate_bps: 1, 2, 5.5 or 11 Mb/s.
    """
    return air_ns(size_bytes + HEADER_BYTES, rate_bps)


ACK_NS = air_ns(ACK_BYTES, CONTROL_BPS)
"""Duration of an acknowledgement or a CTS (same size); in a network of 1 Mb/s both take longer."""


@dataclass(slots=True, eq=False)
class _Station:
    """A node's view of the channel, and its backoff countdown.

    A station is in one of three states: counting down (``from_ns`` is set), frozen by a busy channel, or
    sending. Without a packet it only finishes the backoff after its last packet, then unsubscribes.
    """

    node: int
    counting: dict[int, _Station]
    """The stations with a packet that are not frozen."""
    unsubscribe: Callable[[_Station], None]
    """Cancels a station's subscription to the channel."""
    eifs_ns: int
    listener: Listener | None = None
    """The subscription to the channel; None when there is nothing to count down."""
    event: simpy.Event | None = None
    """Succeeds when the station may send; None without a packet."""
    slots: int = 0
    """Slots left to count down."""
    begins_ns: int = 0
    """Start of its next frame, once that is certain."""
    from_ns: int = _NEVER
    """Start of the countdown; ``_NEVER`` while frozen or sending."""
    free_ns: int = 0
    """End of the interframe space after the last frame that it heard."""
    reserved_ns: int = -DIFS_NS
    """End of the reservations that it has read (NAV)."""
    own_free_ns: int = 0
    """End of the interframe space after its own last frame, including the wait for a reply."""
    sending: bool = False
    arrived: bool = False
    """Its packet has reached the receiver, even if the acknowledgement was lost."""

    @property
    def expiry_ns(self) -> int:
        """Time at which the countdown expires if nothing freezes it."""
        return self.from_ns + self.slots * SLOT_NS

    def on_busy(self, now_ns: int) -> None:
        """Freeze the countdown, unless it expires now: then the station sends too, and the frames collide."""
        from_ns = self.from_ns
        if from_ns == _NEVER:
            return
        if from_ns + self.slots * SLOT_NS <= now_ns:
            if self.event is None:
                self.unsubscribe(self)
            return
        if now_ns > from_ns:
            self.slots -= (now_ns - from_ns) // SLOT_NS
        self.from_ns = _NEVER
        self.counting.pop(self.node, None)

    def on_idle(self, free_ns: int, damaged: bool) -> None:
        """Resume the countdown after the interframe space."""
        self.update_nav(free_ns, damaged)
        if not self.sending:
            self.resume()

    def update_nav(self, free_ns: int, damaged: bool) -> None:
        """Update the reservation (NAV) from the last frame; a longer earlier reservation stays valid."""
        if damaged:
            self.free_ns = max(free_ns + self.eifs_ns, self.reserved_ns + DIFS_NS)
        else:
            if free_ns > self.reserved_ns:
                self.reserved_ns = free_ns
            self.free_ns = self.reserved_ns + DIFS_NS

    def resume(self) -> None:
        """Start the countdown at the end of both interframe spaces."""
        self.from_ns = self.free_ns if self.free_ns > self.own_free_ns else self.own_free_ns
        if self.event is not None:
            self.counting[self.node] = self


class Dcf:
    """Medium access of all stations of one channel."""

    def __init__(self, context: MacContext, wait_after_loss: bool = True) -> None:
        """Create a medium access whose stations have heard and sent nothing yet.

        Args:
            context: Clock, channel and nodes; ``config.mac.rts`` selects RTS/CTS.
            wait_after_loss: True follows the standard: an EIFS after damaged frames, and a sender waits for
                the missing reply. False waits for a DIFS only, as Bianchi's model assumes.
        """
        self._env = context.env
        self._medium = context.medium
        self._rts = context.config.mac.rts
        retries = context.config.mac.retries
        self._attempts = ATTEMPTS if retries is None else 1 + retries
        self._rate_bps = context.config.mac.rate_bps
        self._modulation = IEEE80211B[self._rate_bps][0]
        control_bps = min(self._rate_bps, CONTROL_BPS)
        self._control = IEEE80211B[control_bps][0]
        self._reply_ns, self._rts_ns = air_ns(ACK_BYTES, control_bps), air_ns(RTS_BYTES, control_bps)
        self._record = context.recorder.add_packet
        self._up = context.up
        self._receive = context.receive
        self._eifs_ns = EIFS_NS if wait_after_loss else DIFS_NS
        self._reply_wait_ns = REPLY_WAIT_NS if wait_after_loss else 0
        self._lost = LinkLosses(context.config.loss, context.config.run.seed).lost
        self._stations: dict[int, _Station] = {}
        self._counting: dict[int, _Station] = {}
        self._backing_off: dict[int, _Station] = {}
        self._timer_ns = _NEVER
        self._backoffs = random_below(MAX_WINDOW, context.rng)

    def send(self, packet: Packet, sender: int, receiver: int) -> Generator[simpy.Event, Any, Delivery]:
        """Carry a packet to a neighbour: ``delivery = yield from mac.send(packet, a, b)``.

        Returns:
            ``ok`` when an acknowledgement came; a packet that was dropped after it had arrived has
            ``ACK_LOST``.
        """
        station = self._stations.get(sender)
        if station is None:
            station = self._stations[sender] = _Station(
                sender, self._counting, self._unsubscribe, self._eifs_ns
            )
        station.arrived = False
        window = MIN_WINDOW
        for attempt in range(1, self._attempts + 1):
            turn = self._contend(station, packet.size_bytes)
            if turn is not None:
                yield turn
            if not self._up(sender):
                self._unsubscribe(station)
                self._schedule()
                return Delivery(False, Cause.ACK_LOST if station.arrived else Cause.NODE_DOWN, attempt - 1)
            cause = yield from self._exchange(packet, station, receiver)
            over = not cause or attempt == self._attempts
            window = MIN_WINDOW if over else min(2 * window, MAX_WINDOW)
            self._begin_backoff(station, window)
            if not cause:
                return _FIRST_ATTEMPT if attempt == 1 else Delivery(True, _NONE, attempt)
        yield self._env.timeout(station.own_free_ns - DIFS_NS - self._env.now)
        return Delivery(False, Cause.ACK_LOST if station.arrived else Cause.RETRIES, self._attempts)

    def _contend(self, station: _Station, size_bytes: int) -> simpy.Event | None:
        """Return the event that the station may send; None if nothing can happen before its frame is over."""
        env = self._env
        now_ns = int(env.now)
        self._backing_off.pop(station.node, None)
        for other in tuple(self._backing_off.values()):
            if other.expiry_ns <= now_ns:
                self._unsubscribe(other)
        if station.listener is None:
            self._subscribe(station, now_ns)
        if station.from_ns != _NEVER:
            begins_ns = station.expiry_ns
            if begins_ns < now_ns:
                station.from_ns, station.slots = now_ns, 0
                begins_ns = now_ns
            first_ns = self._rts_ns if self._rts else data_ns(size_bytes, self._rate_bps)
            if self._medium.undisturbed and env.peek() > begins_ns + first_ns:
                station.begins_ns, station.from_ns, station.sending = begins_ns, _NEVER, True
                return None
            self._counting[station.node] = station
            self._schedule()
        station.event = env.event()
        return station.event

    def _subscribe(self, station: _Station, now_ns: int) -> None:
        """Subscribe to the channel; a station that finds it idle for long enough needs no backoff."""
        medium, node = self._medium, station.node
        listener = station.listener = medium.subscribe(node, station.on_busy, station.on_idle)
        station.update_nav(*medium.last_heard(node))
        station.slots = 0
        if listener.busy or station.free_ns > now_ns:
            station.slots = next(self._backoffs) & (MIN_WINDOW - 1)
        if not listener.busy:
            station.from_ns = max(station.free_ns, station.own_free_ns, now_ns)

    def _unsubscribe(self, station: _Station) -> None:
        """Unsubscribe from the channel: there is nothing to send and nothing to count down."""
        self._medium.unsubscribe(station.node)
        self._backing_off.pop(station.node, None)
        station.listener, station.from_ns, station.sending = None, _NEVER, False

    def _begin_backoff(self, station: _Station, window: int) -> None:
        """Draw the next backoff, which counts down even without another packet."""
        station.slots = next(self._backoffs) & (window - 1)
        station.sending = False
        self._backing_off[station.node] = station
        if station.listener is not None and not station.listener.busy:
            station.resume()
        self._schedule()

    def _schedule(self) -> None:
        """Set the timer to the countdown that expires first."""
        if not self._counting:
            return
        first_ns = min([station.from_ns + station.slots * SLOT_NS for station in self._counting.values()])
        if first_ns < self._timer_ns:
            self._timer_ns = first_ns
            timer = self._env.timeout(first_ns - self._env.now)
            timer.callbacks.append(self._fire)

    def _fire(self, _: simpy.Event) -> None:
        """Let every station whose countdown expires now send."""
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
        """Make one attempt; returns ``NONE`` if acknowledged, else the cause (``COLLISION`` without CTS)."""
        env, sender, size_bytes = self._env, station.node, packet.size_bytes
        cts, begins_ns = None, station.begins_ns
        if self._rts:
            cts = yield from self._reserve(packet, station, receiver)
            if cts is None:
                return Cause.COLLISION
            begins_ns = cts.end_ns + GAP_NS
        duration_ns, frame_bytes = data_ns(size_bytes, self._rate_bps), size_bytes + HEADER_BYTES
        rest_ns = GAP_NS + self._reply_ns
        frame = self._start_frame(
            _AIR, packet, sender, receiver, frame_bytes, begins_ns, duration_ns, rest_ns, cts
        )
        yield env.timeout(frame.end_ns - env.now)
        lost = self._lost(sender, receiver)
        cause = self._outcome(frame) or (Cause.LINK if lost else _NONE)
        if cause:
            self._fail_attempt(packet, station, frame, cause, self._reply_wait_ns)
            return cause
        if not station.arrived:
            station.arrived = True
            self._record(frame.end_ns, _DELIVER, packet, sender, receiver, size_bytes)
            self._receive(packet, receiver)
        begins_ns = frame.end_ns + GAP_NS
        answer = self._start_frame(
            _ACK, packet, receiver, sender, ACK_BYTES, begins_ns, self._reply_ns, 0, frame
        )
        yield env.timeout(rest_ns)
        if self._outcome(answer):
            self._fail_attempt(packet, station, answer, Cause.ACK_LOST, 0)
            return Cause.ACK_LOST
        self._medium.clear(answer)
        station.own_free_ns = answer.end_ns + DIFS_NS
        return _NONE

    def _reserve(
        self, packet: Packet, station: _Station, receiver: int
    ) -> Generator[simpy.Event, Any, Transmission | None]:
        """Exchange RTS and CTS; returns the CTS, which the data frame follows, or None on failure."""
        sender, begins_ns, rest_ns = station.node, station.begins_ns, GAP_NS + self._reply_ns + GAP_NS
        rts = self._start_frame(
            _ACK, packet, sender, receiver, RTS_BYTES, begins_ns, self._rts_ns, rest_ns, None
        )
        yield self._env.timeout(rts.end_ns - self._env.now)
        cause = self._outcome(rts)
        if cause:
            self._fail_attempt(packet, station, rts, cause, self._reply_wait_ns)
            return None
        begins_ns = rts.end_ns + GAP_NS
        rest_ns = GAP_NS + data_ns(packet.size_bytes, self._rate_bps) + GAP_NS + self._reply_ns
        cts = self._start_frame(
            _ACK, packet, receiver, sender, ACK_BYTES, begins_ns, self._reply_ns, rest_ns, rts
        )
        yield self._env.timeout(GAP_NS + self._reply_ns)
        cause = self._outcome(cts)
        if cause:
            self._fail_attempt(packet, station, cts, cause, 0)
            return None
        return cts

    def _start_frame(
        self,
        kind: EventKind,
        packet: Packet,
        sender: int,
        receiver: int,
        size_bytes: int,
        begins_ns: int,
        duration_ns: int,
        reserve_ns: int,
        replied_to: Transmission | None,
    ) -> Transmission:
        """Put a frame on the air; the frame to which it replies ends now."""
        how = self._modulation if kind is _AIR else self._control
        frame = self._medium.start(sender, duration_ns, receiver, size_bytes, how, begins_ns, reserve_ns)
        if replied_to is not None:
            self._medium.clear(replied_to)
        self._record(begins_ns, kind, packet, sender, receiver, size_bytes, _NONE, duration_ns)
        if self._counting:
            self._schedule()
        return frame

    def _outcome(self, frame: Transmission) -> Cause:
        """Return why a frame that ends now did not arrive; ``NONE`` if it did."""
        cause = self._medium.outcome(frame)
        if not (self._up(frame.sender) and self._up(frame.receiver)):
            return Cause.NODE_DOWN
        return cause

    def _fail_attempt(
        self, packet: Packet, station: _Station, frame: Transmission, cause: Cause, wait_ns: int
    ) -> None:
        """Record the attempt that failed with this frame; its sender waits ``wait_ns`` for the reply."""
        now_ns = frame.end_ns
        self._medium.clear(frame)
        receiver = frame.receiver if frame.sender == station.node else frame.sender
        self._record(now_ns, EventKind.LOSS, packet, station.node, receiver, packet.size_bytes, cause)
        station.own_free_ns = now_ns + wait_ns + DIFS_NS
