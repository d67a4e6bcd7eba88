"""One shared radio channel: frames on the air, carrier sense, and which frames survive (SPEC 6.3).

A frame is received when its power reaches the receive threshold, exceeds the largest sum of overlapping
powers by the capture ratio, and its receiver was not sending meanwhile. In IEEE 802.11b the stronger frame
survives even if it began later. Receivers of IEEE 802.15.4 keep the frame that began first; above the capture
ratio, noise and interference together give the error rate of its overlapped bits. A node senses a frame whose
mean power reaches the carrier-sense threshold; sensing has no fading. Propagation takes no time.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import simpy
from numpy.random import Generator

from network_sim.types import Cause

if TYPE_CHECKING:
    from network_sim.radio.places import Places
    from network_sim.radio.propagation import Modulation, Radio

MEMORY_NS = 5_000_000
"""Time for which ended transmissions are kept: longer than a medium access looks back."""
REFRESH_NS = 100_000_000
"""Interval at which powers between moving nodes are recomputed: a vehicle moves about a metre."""
_NONE = Cause.NONE
"""A local name, because enumeration members are slow to look up and this is used for every frame."""


@dataclass(slots=True, eq=False)
class Transmission:
    """A frame on the air, on its way to one receiver."""

    sender: int
    receiver: int
    start_ns: int
    end_ns: int
    reserved_ns: int
    """End of the reservation (NAV): the end of the frame, or of the exchange that it is part of."""
    power_w: float
    """Power at the receiver, with fading."""
    size_bytes: int
    modulation: Modulation
    """Modulation, from which ``Radio.error_rate`` computes bit errors."""
    overlaps: list[Transmission]
    """Frames that were on the air at the same time, in the order in which they began."""
    heard: list[Listener]
    """Listeners that sense the frame."""
    earlier: int = 0
    """Number of overlapping frames that began before it."""

    def peak_interference_w(self, powers_w: list[float]) -> float:
        """Return the largest sum of overlapping powers at any instant of this frame.

        Args:
            powers_w: received powers of ``overlaps``, in their order, at one node.
        """
        if len(powers_w) < 2:
            return sum(powers_w)
        frames = self.overlaps
        instants_ns = [max(frame.start_ns, self.start_ns) for frame in frames]
        return max(
            sum(
                power_w
                for frame, power_w in zip(frames, powers_w, strict=True)
                if frame.start_ns <= instant_ns < frame.end_ns
            )
            for instant_ns in instants_ns
        )


def peak_w(frames: Sequence[tuple[Transmission, float]], start_ns: int, end_ns: int) -> float:
    """Return the largest sum of the powers of frames at any instant from ``start_ns`` to ``end_ns``."""
    present = [(one, power_w) for one, power_w in frames if one.start_ns < end_ns and one.end_ns > start_ns]
    instants_ns = [max(one.start_ns, start_ns) for one, _ in present]
    return max(
        (
            sum(power_w for one, power_w in present if one.start_ns <= instant_ns < one.end_ns)
            for instant_ns in instants_ns
        ),
        default=0.0,
    )


@dataclass(slots=True, eq=False)
class Listener:
    """Callbacks of a node that are called when its channel becomes busy or idle."""

    node: int
    on_busy: Callable[[int], None]
    on_idle: Callable[[int, bool], None]
    busy: int = 0
    """Number of transmissions that the node senses now."""


class Medium:
    """One shared channel."""

    def __init__(self, env: simpy.Environment, radio: Radio, places: Places, rng: Generator) -> None:
        """Create an idle channel.

        Args:
            env: Simulation environment; its clock counts nanoseconds.
            radio: Powers and thresholds.
            places: Positions of the nodes.
            rng: Random generator of bit errors.
        """
        self.env = env
        self.radio = radio
        self.places = places
        self._rng = rng
        self._active: list[Transmission] = []
        self._recent: deque[Transmission] = deque()
        self._listeners: dict[int, Listener] = {}
        self._rows_w: dict[int, list[float]] = {}
        self._rows_end_ns: float = math.inf if places.static else 0
        self._fades = radio.fades
        self._rx_w = radio.rx_threshold_w
        self._cs_w = radio.cs_threshold_w

    def power_w(self, sender: int, receiver: int) -> float:
        """Return the power at ``receiver`` of a frame of ``sender``, without fading; 0 for the same node.

        Between moving nodes the value may be up to ``REFRESH_NS`` older than the last frame.
        """
        row_w = self._rows_w.get(sender)
        if row_w is None:
            row_w = self._new_row_w(sender)
        power_w = row_w[receiver]
        return power_w if power_w >= 0.0 else self._link_power_w(sender, receiver)

    def _new_row_w(self, sender: int) -> list[float]:
        """Create the list of a sender's powers at all nodes; a negative entry is not computed yet."""
        row_w = self._rows_w[sender] = [-1.0] * self.places.count
        row_w[sender] = 0.0
        return row_w

    def _link_power_w(self, sender: int, receiver: int) -> float:
        power_w = self.radio.between_w(self.places, sender, receiver, int(self.env.now))
        self._rows_w[sender][receiver] = power_w
        return power_w

    def start(
        self,
        sender: int,
        duration_ns: int,
        receiver: int,
        size_bytes: int = 0,
        modulation: Modulation = "cck11",
        begins_ns: int | None = None,
        reserve_ns: int = 0,
    ) -> Transmission:
        """Put a frame on the air and call the listeners that sense it.

        Args:
            sender: Node that sends.
            duration_ns: Time on the air, with the preamble.
            receiver: Node that receives.
            size_bytes: Size of the frame, from which bit errors follow if the radio has noise.
            modulation: Modulation of the frame.
            begins_ns: Start of the frame: None for now, or later for a reply. Every frame that begins before
                this start must also end after it, because it is counted as overlapping.
            reserve_ns: Duration of the reservation (NAV) after its end, for every node that can read it.

        Returns:
            The frame, to be passed to ``finish`` exactly at its end.
        """
        start_ns = int(self.env.now) if begins_ns is None else begins_ns
        end_ns = start_ns + duration_ns
        if start_ns >= self._rows_end_ns:
            self._rows_w.clear()
            self._rows_end_ns = start_ns + REFRESH_NS
        power_w = self.power_w(sender, receiver)
        if self._fades:
            power_w = self.radio.faded_w(power_w)
        frame = Transmission(
            sender, receiver, start_ns, end_ns, end_ns + reserve_ns, power_w, size_bytes, modulation, [], []
        )
        for other in self._active:
            if other.end_ns > start_ns:
                other.overlaps.append(frame)
                frame.overlaps.append(other)
        frame.earlier = len(frame.overlaps)
        self._active.append(frame)
        listeners = self._listeners
        if len(listeners) > 1 or (listeners and sender not in listeners):
            self._notify_busy(frame)
        return frame

    def _notify_busy(self, frame: Transmission) -> None:
        sender, start_ns, least_w = frame.sender, frame.start_ns, self._cs_w
        row_w = self._rows_w[sender]
        for listener in tuple(self._listeners.values()):
            node = listener.node
            power_w = row_w[node]
            if power_w < least_w and (power_w >= 0.0 or self._link_power_w(sender, node) < least_w):
                continue
            frame.heard.append(listener)
            listener.busy += 1
            if listener.busy == 1:
                listener.on_busy(start_ns)

    def finish(self, frame: Transmission) -> Cause:
        """Return the ``outcome`` of a frame at its end, and ``clear`` it."""
        alone = frame.power_w >= self._rx_w and not frame.overlaps and self.radio.noise_w is None
        cause = _NONE if alone else self.outcome(frame)
        self.clear(frame)
        return cause

    def clear(self, frame: Transmission) -> None:
        """Take a frame off the air at its end and call the listeners whose channel becomes idle."""
        self._active.remove(frame)
        recent = self._recent
        recent.append(frame)
        end_ns = frame.end_ns
        while recent[0].end_ns < end_ns - MEMORY_NS:
            recent.popleft()
        if frame.heard:
            self._notify_idle(frame)

    def _notify_idle(self, frame: Transmission) -> None:
        row_w, listeners = self._rows_w.get(frame.sender) or self._new_row_w(frame.sender), self._listeners
        least_w, clean = self._rx_w, not frame.overlaps
        for listener in frame.heard:
            listener.busy -= 1
            node = listener.node
            if listener.busy or listeners.get(node) is not listener:
                continue
            if clean and row_w[node] >= least_w:
                listener.on_idle(frame.reserved_ns, False)
            else:
                listener.on_idle(*self._overheard(frame, node))

    def _overheard(self, frame: Transmission, node: int) -> tuple[int, bool]:
        """Determine the reception of a frame by a node that overhears it, without fading and noise.

        Returns:
            Time from which the channel is free, and whether the frame was damaged. A node that was sending
            itself notices neither damage nor reservation.
        """
        power_w, overlaps = self.power_w(frame.sender, node), frame.overlaps
        if overlaps:
            if any(other.sender == node for other in overlaps):
                return frame.end_ns, False
            most_w = power_w / self.radio.capture_ratio
            powers_w = [self.power_w(other.sender, node) for other in overlaps]
            if max(powers_w) > most_w or frame.peak_interference_w(powers_w) > most_w:
                return frame.end_ns, True
        if power_w < self._rx_w:
            return frame.end_ns, True
        return frame.reserved_ns, False

    def outcome(self, frame: Transmission) -> Cause:
        """Determine whether a frame that ends now is received; call once, because it draws random numbers.

        Returns:
            ``NONE`` if its receiver got the frame; else ``COLLISION``, ``NOISE`` or ``RANGE``.
        """
        radio, receiver, power_w, interference_w = self.radio, frame.receiver, frame.power_w, 0.0
        if power_w < self._rx_w:
            return Cause.RANGE
        if frame.overlaps:
            if any(other.sender == receiver for other in frame.overlaps):
                return Cause.COLLISION
            powers_w = [radio.faded_w(self.power_w(other.sender, receiver)) for other in frame.overlaps]
            interference_w = frame.peak_interference_w(powers_w)
            if frame.modulation == "oqpsk":
                if self._lost_in_overlap(frame, powers_w, interference_w):
                    return Cause.COLLISION
                interference_w = 0.0
            elif power_w <= radio.capture_ratio * interference_w:
                return Cause.COLLISION
        if radio.noise_w is not None:
            sinr = power_w / (radio.noise_w + interference_w)
            if self._rng.random() < radio.error_rate(sinr, frame.size_bytes, frame.modulation):
                return Cause.NOISE
        return _NONE

    def outcomes(
        self, frame: Transmission, preamble_ns: int, instants_ns: Sequence[int], parts_bytes: Sequence[int]
    ) -> list[Cause]:
        """Determine which parts of a frame that ends now are received; call once, as ``outcome``.

        A part is lost to the frames that overlap it, or to bit errors in it; all are if the preamble is.

        Args:
            frame: the frame.
            preamble_ns: duration of its preamble, which is in the first part.
            instants_ns: (P + 1,) start of each part, and end of the last one.
            parts_bytes: (P,) bytes of each part.

        Returns:
            (P,) causes, as those of ``outcome``.
        """
        radio, receiver, power_w, count = self.radio, frame.receiver, frame.power_w, len(parts_bytes)
        if power_w < self._rx_w:
            return [Cause.RANGE] * count
        if not frame.overlaps and radio.noise_w is None:
            return [_NONE] * count
        if any(other.sender == receiver for other in frame.overlaps):
            return [Cause.COLLISION] * count
        others = [(one, radio.faded_w(self.power_w(one.sender, receiver))) for one in frame.overlaps]
        most_w, begins_ns = power_w / radio.capture_ratio, frame.start_ns
        if others and peak_w(others, begins_ns, begins_ns + preamble_ns) >= most_w:
            return [Cause.COLLISION] * count
        causes = []
        for k, part_bytes in enumerate(parts_bytes):
            interference_w = peak_w(others, instants_ns[k], instants_ns[k + 1])
            cause = Cause.COLLISION if interference_w >= most_w else _NONE
            if not cause and radio.noise_w is not None:
                sinr = power_w / (radio.noise_w + interference_w)
                if self._rng.random() < radio.error_rate(sinr, part_bytes, frame.modulation):
                    cause = Cause.NOISE
            causes.append(cause)
        return causes

    def _lost_in_overlap(self, frame: Transmission, powers_w: list[float], interference_w: float) -> bool:
        """Return whether an 802.15.4 receiver loses a frame to the frames that overlap it.

        The receiver was busy with an earlier frame, the frames' powers are too close (the same spreading
        code separates frames worse than it suppresses noise), or overlapped bits are wrong.
        """
        if max(powers_w[: frame.earlier], default=0.0) >= self._rx_w:
            return True
        if frame.power_w < self.radio.capture_ratio * interference_w:
            return True
        if not interference_w:
            return False
        begin_ns = max(frame.start_ns, min(other.start_ns for other in frame.overlaps))
        end_ns = min(frame.end_ns, max(other.end_ns for other in frame.overlaps))
        sinr = frame.power_w / (interference_w + (self.radio.noise_w or 0.0))
        overlapped_bytes = frame.size_bytes * (end_ns - begin_ns) / (frame.end_ns - frame.start_ns)
        return self._rng.random() < self.radio.error_rate(sinr, overlapped_bytes, "oqpsk")

    @property
    def undisturbed(self) -> bool:
        """Whether the channel is idle and has at most one listener."""
        return not self._active and len(self._listeners) < 2

    def _sensed(self, frame: Transmission, node: int) -> bool:
        return self.power_w(frame.sender, node) >= self._cs_w

    def busy_until(self, node: int, at_ns: int) -> bool:
        """Return whether this node senses another node's frame in the last instant before ``at_ns``.

        ``at_ns`` is now, or later if nothing happens before.
        """
        for frame in self._active:
            if frame.start_ns < at_ns and self._sensed(frame, node):
                return True
        for frame in reversed(self._recent):
            if frame.end_ns < at_ns:
                return False
            if self._sensed(frame, node):
                return True
        return False

    def last_heard(self, node: int) -> tuple[int, bool]:
        """Return when the channel at this node became free, and whether the last frame was damaged there.

        These are the arguments that a listener's ``on_idle`` would have received.

        Returns:
            The time (``-MEMORY_NS`` if nothing was heard for that long) and the damage.
        """
        for frame in reversed(self._recent):
            if self._sensed(frame, node):
                return self._overheard(frame, node)
        return -MEMORY_NS, False

    def subscribe(
        self, node: int, on_busy: Callable[[int], None], on_idle: Callable[[int, bool], None]
    ) -> Listener:
        """Call back when the channel at this node becomes busy or idle, until ``unsubscribe``.

        Args:
            node: Node that listens; each node has one listener.
            on_busy: Called with the time in ns, which is in the future for a reply that begins later.
            on_idle: Called with the time from which the channel is free (now, or the end of the frame's
                reservation), and whether the last frame was received with errors (EIFS).
        """
        listener = self._listeners[node] = Listener(node, on_busy, on_idle)
        now_ns = int(self.env.now)
        for frame in self._active:
            if frame.end_ns > now_ns and self._sensed(frame, node):
                frame.heard.append(listener)
                listener.busy += 1
        return listener

    def unsubscribe(self, node: int) -> None:
        """Stop the callbacks of a node."""
        self._listeners.pop(node, None)
