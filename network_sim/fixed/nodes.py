"""Camera nodes and relays: cameras split images into fragments, stations buffer packets and send them."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Generator
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
import simpy

from network_sim.config import GUARD_S, NodesConfig
from network_sim.fixed.images import Book, Fragments, Image, request_packets_bytes
from network_sim.fixed.routing import Routes
from network_sim.types import NS_PER_S, Cause, Delivery, Packet, PacketKind, to_ns

if TYPE_CHECKING:
    from network_sim.mac import Mac

STATUS_AFTER_NS = 2 * NS_PER_S
"""Time awake without a new fragment after which the sink requests the missing ones; a camera waits twice as
long before it sends its last fragment again."""
PAUSE_NS = NS_PER_S // 50
"""Mean pause after the second unacknowledged packet in a row, doubled with each further one; without it,
hidden nodes collide for ever."""
MAX_DOUBLINGS = 8
"""Most times that the mean pause is doubled."""
GUARD_NS = to_ns(GUARD_S)


@dataclass(slots=True)
class Shared:
    """State that all nodes of a network share."""

    env: simpy.Environment
    config: NodesConfig
    rng: np.random.Generator
    """Random generator of the pauses of all nodes."""
    book: Book
    routes: Routes
    """Routes over the nodes that have not failed."""
    unreachable: tuple[int, ...]
    """Nodes without a route to the sink even when none has failed."""
    destination: int
    """Destination of images: the sink, or the cloud behind it."""
    acknowledged: bool
    """The medium access acknowledges packets, so that a sender learns whether its packet arrived."""
    failed: list[bool]
    up: list[bool]
    """For each node, True if it is neither failed nor asleep."""
    mac: Mac = field(init=False)
    pace_ns: int = 0
    """Time from one packet of a node to its next, where regulation limits how often it may send; else 0."""
    sleeps_at_ns: int | None = None
    """Time at which the nodes fall asleep next; None without a duty cycle."""
    taken: set[tuple[int, int]] = field(default_factory=set)
    """(packet id, neighbour) of packets that reached this neighbour before their sender's attempt ended."""
    requested: dict[int, tuple[int, ...]] = field(default_factory=dict)
    """Fragments that each STATUS packet (by id) requests; empty if the image is complete."""

    @property
    def sink(self) -> int:
        """The sink, destination of all routes."""
        return self.routes.sink

    @property
    def status_after_ns(self) -> int:
        """``STATUS_AFTER_NS``, the time that nodes sleep in each period, and the time of two packets."""
        asleep_ns = round((1.0 - self.config.duty_cycle) * to_ns(self.config.duty_period_s))
        return STATUS_AFTER_NS + asleep_ns + 2 * self.pace_ns

    def next_hop(self, at: int, destination: int) -> int:
        """Return the next node of a packet's route; -1 if there is none."""
        return self.routes.next_hop(at, min(destination, self.sink))


class Station:
    """A node's buffer and the loop that sends its packets; the sink has one for its STATUS packets."""

    def __init__(self, shared: Shared, index: int) -> None:
        """Start the sending loop with an empty buffer; a ``Camera`` sets ``camera`` on its own station."""
        self.index = index
        self.camera: Camera | None = None
        self.on_given_up: Callable[[Packet, Cause], None] | None = None
        """Called with a packet that was dropped, and why, unless the node believes that it was delivered."""
        self.buffer: deque[Packet] = deque()
        self._shared = shared
        self._idle: simpy.Event | None = None
        self._unanswered = 0
        """Number of consecutive packets that were not acknowledged."""
        shared.env.process(self._run())

    def put(self, packet: Packet) -> None:
        """Enqueue a packet to forward; a full buffer drops it."""
        book = self._shared.book
        book.entered(packet, self.index)
        if len(self.buffer) >= self._shared.config.buffer_packets:
            book.dropped(packet, self.index, Cause.BUFFER)
            return
        self.buffer.append(packet)
        self.wake()

    def wake(self) -> None:
        """Continue the sending loop if it is idle."""
        if self._idle is not None:
            self._idle.succeed()
            self._idle = None

    def lose_buffer(self) -> None:
        """Drop all buffered packets: the node failed."""
        while self.buffer:
            self._drop(self.buffer.popleft(), Cause.NODE_DOWN)

    def _run(self) -> Generator[simpy.Event, Any, None]:
        shared = self._shared
        while True:
            packet = self._next()
            if packet is None:
                self._idle = shared.env.event()
                yield self._idle
                continue
            hop = shared.next_hop(self.index, packet.destination)
            delivery = yield from shared.mac.send(packet, self.index, hop)
            if delivery.under_way:
                self._count_own(packet, -1)
                continue
            self._finish_attempt(packet, hop, delivery)
            pause_ns = self._pause_ns(delivery)
            if pause_ns:
                yield shared.env.timeout(pause_ns)

    def report(self, packet: Packet, hop: int, delivery: Delivery) -> None:
        """Process the outcome of a packet that was still under way after ``Mac.send``."""
        self._count_own(packet, 1)
        self._finish_attempt(packet, hop, delivery)
        self.wake()

    def _count_own(self, packet: Packet, change: int) -> None:
        """Change the camera's count of waiting fragments: packets under way take no room in the buffer."""
        if self._is_own_fragment(packet):
            assert self.camera is not None
            self.camera.waiting += change

    def _finish_attempt(self, packet: Packet, hop: int, delivery: Delivery) -> None:
        """Process a packet after an attempt to send: it has arrived, stays in the buffer, or is dropped."""
        shared = self._shared
        taken = (packet.id, hop) in shared.taken
        shared.taken.discard((packet.id, hop))
        if taken:
            if self._is_own_fragment(packet):
                assert self.camera is not None
                self.camera.on_sent(packet, delivery.ok, delivery.ok and hop == shared.sink)
        elif not delivery.ok and not shared.up[self.index] and not shared.failed[self.index]:
            self.buffer.appendleft(packet)  # the node fell asleep: it sends this packet when it wakes
        else:
            self._drop(packet, delivery.cause or Cause.RETRIES, ok=delivery.ok)

    def _pause_ns(self, delivery: Delivery) -> int:
        """Draw the pause in ns after a packet with this outcome."""
        if delivery.ok:
            self._unanswered = 0
        elif delivery.cause in (Cause.RETRIES, Cause.ACK_LOST):
            self._unanswered += 1
            if self._unanswered > 1:
                mean_ns = PAUSE_NS << min(self._unanswered - 2, MAX_DOUBLINGS)
                return int(self._shared.rng.exponential(mean_ns))
        return 0

    def _next(self) -> Packet | None:
        """Take the next packet from the buffer.

        Returns:
            The packet; None if there is none, the node sleeps or soon will, or the first packet has no route
            at present.
        """
        shared = self._shared
        env, sleeps_at_ns = shared.env, shared.sleeps_at_ns
        if not shared.up[self.index] or (sleeps_at_ns is not None and env.now + GUARD_NS > sleeps_at_ns):
            return None
        if self.camera is not None:
            self.camera.fill_buffer(self.buffer)
        while self.buffer:
            packet = self.buffer[0]
            if shared.next_hop(self.index, packet.destination) < 0:
                if packet.kind is PacketKind.IMAGE and not shared.book.images[packet.image].closed:
                    return None
                self._drop(self.buffer.popleft(), Cause.NO_ROUTE)
            elif self._late(packet):
                self._drop(self.buffer.popleft(), Cause.DEADLINE)
            else:
                return self.buffer.popleft()
        return None

    def _late(self, packet: Packet) -> bool:
        deadline_s = self._shared.config.deadline_s
        if deadline_s is None or packet.kind is not PacketKind.IMAGE:
            return False
        age_ns = self._shared.env.now - self._shared.book.images[packet.image].captured_ns
        return bool(age_ns >= to_ns(deadline_s))

    def _is_own_fragment(self, packet: Packet) -> bool:
        return packet.source == self.index and packet.kind is PacketKind.IMAGE

    def _drop(self, packet: Packet, cause: Cause, ok: bool = False) -> None:
        """Drop a packet; ``ok`` means that the sender believes it was delivered."""
        self._shared.book.dropped(packet, self.index, cause)
        if self._is_own_fragment(packet):
            assert self.camera is not None
            self.camera.on_sent(packet, ok, False)
        elif self.on_given_up is not None and not ok:
            self.on_given_up(packet, cause)


class Outgoing:
    """Sending state of one image at its camera."""

    def __init__(self, image: Image, settled: simpy.Event, request_packets: int = 0) -> None:
        """Start with all fragments unsent; ``settled`` is triggered when no more must be sent.

        Those after the image's first bytes wait for all packets of a request, if it has any.
        """
        self.image = image
        self.requested = Fragments(request_packets)
        """Packets of the sink's request that have come."""
        self.to_send = deque(range(self.sendable))
        self.queued: set[int] = set()
        """Fragments in the buffer or on the air."""
        self.confirmed = Fragments(image.count)
        """Fragments that, as the camera knows, have reached the sink."""
        self.settled = settled
        self.last_news_ns = 0
        self.probed = False

    @property
    def waits(self) -> bool:
        """Whether the camera waits for the sink's request before it sends more."""
        return bool(self.requested.missing_count)

    @property
    def sendable(self) -> int:
        """Number of fragments that may be sent."""
        return self.image.first_count if self.waits else self.image.count


class Camera:
    """Takes images and keeps each until the sink has it or it is given up."""

    def __init__(self, shared: Shared, station: Station, phase_ns: int) -> None:
        """Start the camera; it takes its first image at ``phase_ns``, unless its images have times."""
        self.recovered = shared.env.event()
        """Event that triggers when the node recovers from a failure; then a new event replaces it."""
        self._shared = shared
        self._station = station
        self._open: dict[int, Outgoing] = {}
        self.waiting = 0
        """Number of its fragments in the buffer or being sent."""
        self._buffer_share = max(1, shared.config.buffer_packets // 2)
        station.camera = self
        shared.book.cameras += 1
        shared.env.process(self._capture(phase_ns))

    def fill_buffer(self, buffer: deque[Packet]) -> None:
        """Put the next fragments into the buffer, at most half of it; the other half is for forwarding."""
        shared = self._shared
        for outgoing in self._open.values():
            while outgoing.to_send:
                if self.waiting >= self._buffer_share or len(buffer) >= shared.config.buffer_packets:
                    return
                index = outgoing.to_send.popleft()
                packet = shared.book.fragment(outgoing.image, index, self._station.index, shared.destination)
                outgoing.queued.add(index)
                self.waiting += 1
                shared.book.entered(packet, self._station.index)
                buffer.append(packet)

    def on_sent(self, packet: Packet, ok: bool, confirmed: bool) -> None:
        """Process a sent fragment: delivered as far as the node knows (``ok``), ``confirmed`` by the sink."""
        shared = self._shared
        self.waiting -= 1
        outgoing = self._open.get(packet.image)
        if outgoing is None:
            return
        index = outgoing.image.index_of(packet)
        outgoing.queued.discard(index)
        outgoing.last_news_ns = int(shared.env.now)
        if confirmed and shared.acknowledged:
            outgoing.confirmed.add(index)
        elif not ok and shared.config.retransmit:
            outgoing.to_send.append(index)
        self._settle_if_done(outgoing)

    def _settle_if_done(self, outgoing: Outgoing) -> None:
        """Stop sending an image if nothing of it is left to send, or start to wait for the sink's answer."""
        shared = self._shared
        all_sent = not outgoing.to_send and not outgoing.queued
        if all_sent and not shared.config.retransmit and not outgoing.waits:
            outgoing.image.sending_over = True
            self._settle(outgoing)
            shared.book.give_up_if_lost(outgoing.image)
        elif not outgoing.confirmed.missing_count and not outgoing.waits:
            self._settle(outgoing)
        elif all_sent and not outgoing.probed:
            outgoing.probed = True
            shared.env.process(self._probe(outgoing))

    def on_status(self, image: int, missing: tuple[int, ...]) -> None:
        """Process a STATUS packet with the fragments missing at the sink, none if the image is complete."""
        outgoing = self._open.get(image)
        if outgoing is None:
            return
        if not missing:
            self._settle(outgoing)
            return
        outgoing.last_news_ns = int(self._shared.env.now)
        known = outgoing.queued.union(outgoing.to_send)
        outgoing.to_send.extend(
            index for index in missing if index not in known and index < outgoing.sendable
        )
        self._station.wake()

    def on_request(self, image: int, number: int) -> None:
        """Process packet ``number`` of the sink's request: with the last one, all other fragments follow."""
        outgoing = self._open.get(image)
        if outgoing is None or not outgoing.waits:
            return
        outgoing.requested.add(number)
        if not outgoing.waits:
            outgoing.last_news_ns = int(self._shared.env.now)
            outgoing.to_send.extend(range(outgoing.image.first_count, outgoing.image.count))
            self._settle_if_done(outgoing)
            self._station.wake()

    def _settle(self, outgoing: Outgoing) -> None:
        """Stop sending an image."""
        if self._open.pop(outgoing.image.id, None) is not None:
            outgoing.settled.succeed()

    def _probe(self, outgoing: Outgoing) -> Generator[simpy.Event, Any, None]:
        """Send the last fragment again after long silence: the sink may have received none of the image, or
        its request may be lost.
        """
        env, wait_ns = self._shared.env, 2 * self._shared.status_after_ns
        again = self._shared.config.retransmit
        while outgoing.image.id in self._open and (again or outgoing.waits):
            silent_ns = env.now - outgoing.last_news_ns
            if silent_ns >= wait_ns and not outgoing.to_send and not outgoing.queued:
                outgoing.to_send.append(outgoing.sendable - 1)
                outgoing.last_news_ns = int(env.now)
                self._station.wake()
                silent_ns = 0
            yield env.timeout(max(wait_ns - silent_ns, GUARD_NS))

    def _capture(self, phase_ns: int) -> Generator[simpy.Event, Any, None]:
        shared, config = self._shared, self._shared.config
        taken, times_ns = 0, [to_ns(time_s) for time_s in config.image_times_s]
        yield shared.env.timeout(times_ns[0] if times_ns else phase_ns)
        while config.images == 0 or taken < config.images:
            if shared.failed[self._station.index]:
                yield self.recovered
                continue
            settled = self._take_image(taken)
            taken += 1
            if settled is None and config.images == 0 and config.interval_s == 0.0:
                break  # there will never be a route: one expired image is enough
            if times_ns:
                if taken < len(times_ns):
                    yield shared.env.timeout(max(0, times_ns[taken] - int(shared.env.now)))
            elif config.interval_s:
                yield shared.env.timeout(to_ns(config.interval_s))
            elif settled is not None:
                yield settled
        shared.book.cameras -= 1
        shared.book.end_if_nothing_left()

    def _take_image(self, number: int) -> simpy.Event | None:
        """Take an image; returns its ``settled`` event, or None without a route to the sink."""
        shared, config = self._shared, self._shared.config
        node = self._station.index
        waits = bool(config.first_bytes_by_node)
        first_bytes = config.first_bytes_by_node[node] if waits else 0
        image = shared.book.capture(node, config.size_bytes(node, number), first_bytes)
        if node in shared.unreachable:
            shared.book.close(image, -1, Cause.NO_ROUTE)
            return None
        request_packets = len(request_packets_bytes(config, node)) if waits else 0
        outgoing = self._open[image.id] = Outgoing(image, shared.env.event(), request_packets)
        if config.deadline_s is not None:
            shared.env.process(self._expire(outgoing, to_ns(config.deadline_s)))
        self._station.wake()
        return outgoing.settled

    def _expire(self, outgoing: Outgoing, deadline_ns: int) -> Generator[simpy.Event, Any, None]:
        yield self._shared.env.timeout(deadline_ns)
        self._settle(outgoing)
        self._shared.book.close(outgoing.image, -1, Cause.DEADLINE)
