"""Contention of IEEE 802.11's distributed coordination function: carrier sense, backoffs, RTS/CTS (SPEC 6.3).

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
from network_sim.mac.phy import RTS_BYTES, Answer, PhysicalLayer
from network_sim.radio.losses import LinkLosses
from network_sim.radio.propagation import Modulation
from network_sim.types import Cause, EventKind, Packet

if TYPE_CHECKING:
    from network_sim.mac.medium import Listener, Transmission

_NEVER = 2**62
_ACK, _NONE = EventKind.ACK, Cause.NONE
"""Local names, because enumeration members are slow to look up and these are used for every packet."""


@dataclass(slots=True, eq=False)
class Station:
    """A node's view of the channel, and its backoff countdown.

    A station is in one of three states: counting down (``from_ns`` is set), frozen by a busy channel, or
    sending. Without a packet it only finishes the backoff after its last packet, then unsubscribes.
    """

    node: int
    counting: dict[int, Station]
    """The stations with a packet that are not frozen."""
    unsubscribe: Callable[[Station], None]
    """Cancels a station's subscription to the channel."""
    slot_ns: int
    difs_ns: int
    eifs_ns: int
    reserved_ns: int
    """End of the reservations that it has read (NAV)."""
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
    own_free_ns: int = 0
    """End of the interframe space after its own last frame, including the wait for a reply."""
    sending: bool = False

    @property
    def expiry_ns(self) -> int:
        """Time at which the countdown expires if nothing freezes it."""
        return self.from_ns + self.slots * self.slot_ns

    def on_busy(self, now_ns: int) -> None:
        """Freeze the countdown, unless it expires now: then the station sends too, and the frames collide."""
        from_ns = self.from_ns
        if from_ns == _NEVER:
            return
        if from_ns + self.slots * self.slot_ns <= now_ns:
            if self.event is None:
                self.unsubscribe(self)
            return
        if now_ns > from_ns:
            self.slots -= (now_ns - from_ns) // self.slot_ns
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
            self.free_ns = max(free_ns + self.eifs_ns, self.reserved_ns + self.difs_ns)
        else:
            if free_ns > self.reserved_ns:
                self.reserved_ns = free_ns
            self.free_ns = self.reserved_ns + self.difs_ns

    def resume(self) -> None:
        """Start the countdown at the end of both interframe spaces."""
        self.from_ns = self.free_ns if self.free_ns > self.own_free_ns else self.own_free_ns
        if self.event is not None:
            self.counting[self.node] = self


class Contention:
    """The stations of one channel, and the parts that all their exchanges have in common."""

    def __init__(self, context: MacContext, layer: PhysicalLayer, wait_after_loss: bool = True) -> None:
        """Create a medium access whose stations have heard and sent nothing yet.

        Args:
            context: Clock, channel and nodes; ``config.mac.rts`` selects RTS/CTS.
            layer: Physical layer of all stations.
            wait_after_loss: True follows the standard: an EIFS after damaged frames, and a sender waits for
                the missing reply. False waits for a DIFS only, as Bianchi's model assumes.
        """
        self._env = context.env
        self._medium = context.medium
        self._layer = layer
        self._rts = context.config.mac.rts
        retries = context.config.mac.retries
        self._attempts = layer.attempts if retries is None else 1 + retries
        self._record = context.recorder.add_packet
        self._up = context.up
        self._receive = context.receive
        self._gap_ns, self._slot_ns, self._difs_ns = layer.gap_ns, layer.slot_ns, layer.difs_ns
        self._min_window, self._max_window = layer.min_window, layer.max_window
        self._rts_ns = layer.rts_ns
        self._eifs_ns = layer.eifs_ns if wait_after_loss else layer.difs_ns
        self._reply_wait_ns = layer.reply_wait_ns if wait_after_loss else 0
        self._lost = LinkLosses(context.config.loss, context.config.run.seed).lost
        self._stations: dict[int, Station] = {}
        self._counting: dict[int, Station] = {}
        self._backing_off: dict[int, Station] = {}
        self._timer_ns = _NEVER
        self._backoffs = random_below(layer.max_window, context.rng)

    def _station(self, node: int) -> Station:
        """Return the station of a node, which is created when it sends for the first time."""
        station = self._stations.get(node)
        if station is None:
            station = self._stations[node] = Station(
                node,
                self._counting,
                self._unsubscribe,
                self._slot_ns,
                self._difs_ns,
                self._eifs_ns,
                reserved_ns=-self._difs_ns,
            )
        return station

    def _contend(self, station: Station, frame_ns: int) -> simpy.Event | None:
        """Return the event that the station may send; None if nothing can happen before its frame is over.

        Args:
            station: the station, which has something to send.
            frame_ns: time on the air of its next data frame.
        """
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
            first_ns = self._rts_ns if self._rts else frame_ns
            if self._medium.undisturbed and env.peek() > begins_ns + first_ns:
                station.begins_ns, station.from_ns, station.sending = begins_ns, _NEVER, True
                return None
            self._counting[station.node] = station
            self._schedule()
        station.event = env.event()
        return station.event

    def _subscribe(self, station: Station, now_ns: int) -> None:
        """Subscribe to the channel; a station that finds it idle for long enough needs no backoff."""
        medium, node = self._medium, station.node
        listener = station.listener = medium.subscribe(node, station.on_busy, station.on_idle)
        station.update_nav(*medium.last_heard(node))
        station.slots = 0
        if listener.busy or station.free_ns > now_ns:
            station.slots = next(self._backoffs) & (self._min_window - 1)
        if not listener.busy:
            station.from_ns = max(station.free_ns, station.own_free_ns, now_ns)

    def _unsubscribe(self, station: Station) -> None:
        """Unsubscribe from the channel: there is nothing to send and nothing to count down."""
        self._medium.unsubscribe(station.node)
        self._backing_off.pop(station.node, None)
        station.listener, station.from_ns, station.sending = None, _NEVER, False

    def _begin_backoff(self, station: Station, window: int) -> None:
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
        slot_ns = self._slot_ns
        first_ns = min([station.from_ns + station.slots * slot_ns for station in self._counting.values()])
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

    def _reserve(
        self, packet: Packet, station: Station, receiver: int, rest_ns: int
    ) -> Generator[simpy.Event, Any, tuple[Transmission | None, Cause]]:
        """Exchange RTS and CTS for a frame.

        Args:
            packet: the packet of the frame, or its first one.
            station: the sender.
            receiver: the node that is asked.
            rest_ns: duration of the exchange after the CTS.

        Returns:
            The CTS, which the frame follows, and ``NONE``; or None and the cause of the failure.
        """
        cts, sender, gap_ns = self._layer.cts, station.node, self._gap_ns
        asked = (self._layer.control.modulation, sender, receiver, RTS_BYTES)
        after_ns = gap_ns + cts.duration_ns + gap_ns
        rts = self._start_frame(*asked, station.begins_ns, self._rts_ns, after_ns, None)
        self._begun(rts, packet)
        yield self._env.timeout(rts.end_ns - self._env.now)
        cause = self._outcome(rts)
        if cause:
            self._end_failed(station, rts, self._reply_wait_ns)
            return None, cause
        reply = self._start_answer(cts, packet, rts, rest_ns)
        yield self._env.timeout(gap_ns + cts.duration_ns)
        cause = self._outcome(reply)
        if cause:
            self._end_failed(station, reply, 0)
            return None, cause
        return reply, _NONE

    def _start_frame(
        self,
        modulation: Modulation,
        sender: int,
        receiver: int,
        size_bytes: int,
        begins_ns: int,
        duration_ns: int,
        reserve_ns: int,
        replied_to: Transmission | None,
    ) -> Transmission:
        """Put a frame on the air; the frame to which it replies ends now."""
        frame = self._medium.start(
            sender, duration_ns, receiver, size_bytes, modulation, begins_ns, reserve_ns
        )
        if replied_to is not None:
            self._medium.clear(replied_to)
        return frame

    def _start_answer(
        self, answer: Answer, packet: Packet, asked: Transmission, reserve_ns: int = 0
    ) -> Transmission:
        """Put the answer to a frame that ends now on the air."""
        begins_ns, control = asked.end_ns + self._gap_ns, self._layer.control.modulation
        ends = asked.receiver, asked.sender
        frame = self._start_frame(
            control, *ends, answer.size_bytes, begins_ns, answer.duration_ns, reserve_ns, asked
        )
        self._begun(frame, packet)
        return frame

    def _begun(self, frame: Transmission, packet: Packet) -> None:
        """Record an RTS or an answer that was put on the air."""
        duration_ns = frame.end_ns - frame.start_ns
        ends = frame.sender, frame.receiver
        self._record(frame.start_ns, _ACK, packet, *ends, frame.size_bytes, _NONE, duration_ns)
        if self._counting:
            self._schedule()

    def _outcome(self, frame: Transmission) -> Cause:
        """Return why a frame that ends now did not arrive; ``NONE`` if it did."""
        cause = self._medium.outcome(frame)
        if not (self._up(frame.sender) and self._up(frame.receiver)):
            return Cause.NODE_DOWN
        return cause

    def _end_failed(self, station: Station, frame: Transmission, wait_ns: int) -> None:
        """End an exchange that failed with this frame; its sender waits ``wait_ns`` for the reply."""
        self._medium.clear(frame)
        station.own_free_ns = frame.end_ns + wait_ns + self._difs_ns

    def _end_well(self, station: Station, answer: Transmission) -> None:
        """End an exchange with its last answer."""
        self._medium.clear(answer)
        station.own_free_ns = answer.end_ns + self._difs_ns
