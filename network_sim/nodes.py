"""Camera nodes and relays: take images, cut them up, keep packets in a buffer, send one after the other."""

from __future__ import annotations

from collections import deque
from collections.abc import Generator
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
import simpy

from network_sim.config import NodesConfig
from network_sim.images import Book, Fragments, Image
from network_sim.routing import Routes
from network_sim.types import NS_PER_S, Cause, Delivery, Packet, PacketKind, to_ns

if TYPE_CHECKING:
    from network_sim.mac import Mac

QUIET_NS = 2 * NS_PER_S
"""Silence, while awake, after which the sink says what it lacks; a camera waits twice as long."""
PAUSE_NS = NS_PER_S // 50
"""Mean pause after the second packet in a row that nobody answered; it doubles with each further one, else
nodes that cannot hear one another collide for ever."""
MAX_DOUBLINGS = 8
GUARD_NS = NS_PER_S // 20
"""No packet is begun so shortly before the nodes fall asleep."""


@dataclass(slots=True)
class Shared:
    """What all nodes of a network share."""

    env: simpy.Environment
    config: NodesConfig
    rng: np.random.Generator
    """For the pauses of all nodes."""
    book: Book
    routes: Routes
    """Of the nodes that have not failed."""
    unreachable: tuple[int, ...]
    """Nodes without a way to the sink even when none has failed."""
    destination: int
    """Of images: the sink or the cloud behind it."""
    confirms: bool
    """A sender learns whether its packet arrived."""
    failed: list[bool]
    up: list[bool]
    """Neither failed nor asleep."""
    mac: Mac = field(init=False)
    sleeps_at_ns: int | None = None
    """When the nodes fall asleep next."""
    taken: set[tuple[int, int]] = field(default_factory=set)
    """Packets, each with the neighbour that has it, whose sender has not finished with them."""
    asked: dict[int, tuple[int, ...]] = field(default_factory=dict)
    """Fragments that a STATUS packet asks for; none if the image is complete."""

    @property
    def sink(self) -> int:
        """The node where all routes end."""
        return self.routes.sink

    @property
    def quiet_ns(self) -> int:
        """``QUIET_NS`` and the time that nodes sleep."""
        return QUIET_NS + round((1.0 - self.config.duty_cycle) * to_ns(self.config.duty_period_s))

    def next_hop(self, at: int, destination: int) -> int:
        """Where a packet goes next; -1 if there is no way."""
        return self.routes.next_hop(at, min(destination, self.sink))


class Station:
    """A node's buffer, and the loop that empties it. The sink has one too, for what it tells the nodes."""

    def __init__(self, shared: Shared, index: int) -> None:
        """An empty buffer; ``camera`` is set for nodes that have one."""
        self.index = index
        self.camera: Camera | None = None
        self.buffer: deque[Packet] = deque()
        self._shared = shared
        self._idle: simpy.Event | None = None
        self._unanswered = 0
        """Packets in a row that the next node did not acknowledge."""
        shared.env.process(self._run())

    def put(self, packet: Packet) -> None:
        """Take a packet to hand on; if the buffer is full it is lost."""
        book = self._shared.book
        book.entered(packet, self.index)
        if len(self.buffer) >= self._shared.config.buffer_packets:
            book.dropped(packet, self.index, Cause.BUFFER)
            return
        self.buffer.append(packet)
        self.kick()

    def kick(self) -> None:
        """Look again whether something can be sent."""
        if self._idle is not None:
            self._idle.succeed()
            self._idle = None

    def lose_buffer(self) -> None:
        """The node failed."""
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
            self._account(packet, hop, delivery)
            pause_ns = self._pause_ns(delivery)
            if pause_ns:
                yield shared.env.timeout(pause_ns)

    def _account(self, packet: Packet, hop: int, delivery: Delivery) -> None:
        """Hand on, keep or give up a packet, as the medium access has said and the next node has done."""
        shared = self._shared
        taken = (packet.id, hop) in shared.taken
        shared.taken.discard((packet.id, hop))
        if taken:
            if self._own(packet):
                assert self.camera is not None
                self.camera.sent(packet, delivery.ok, delivery.ok and hop == shared.sink)
        elif not delivery.ok and not shared.up[self.index] and not shared.failed[self.index]:
            self.buffer.appendleft(packet)  # it fell asleep: it goes on when it wakes
        else:
            self._drop(packet, delivery.cause or Cause.RETRIES, ok=delivery.ok)

    def _pause_ns(self, delivery: Delivery) -> int:
        """How long to be silent after this packet."""
        if delivery.ok:
            self._unanswered = 0
        elif delivery.cause in (Cause.RETRIES, Cause.ACK_LOST):
            self._unanswered += 1
            if self._unanswered > 1:
                mean_ns = PAUSE_NS << min(self._unanswered - 2, MAX_DOUBLINGS)
                return int(self._shared.rng.exponential(mean_ns))
        return 0

    def _next(self) -> Packet | None:
        """The packet to send now, taken from the buffer; None if there is nothing to send, or no time."""
        shared = self._shared
        env, sleeps_at_ns = shared.env, shared.sleeps_at_ns
        if not shared.up[self.index] or (sleeps_at_ns is not None and env.now + GUARD_NS > sleeps_at_ns):
            return None
        if self.camera is not None:
            self.camera.fill(self.buffer)
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

    def _own(self, packet: Packet) -> bool:
        return packet.source == self.index and packet.kind is PacketKind.IMAGE

    def _drop(self, packet: Packet, cause: Cause, ok: bool = False) -> None:
        """``ok``: the node believes that it was delivered."""
        self._shared.book.dropped(packet, self.index, cause)
        if self._own(packet):
            assert self.camera is not None
            self.camera.sent(packet, ok, False)


class Outgoing:
    """What a camera knows of an image that it sends."""

    def __init__(self, image: Image, settled: simpy.Event) -> None:
        """Nothing is sent yet; ``settled`` happens when there is no more to send."""
        self.image = image
        self.to_send = deque(range(image.count))
        self.queued: set[int] = set()
        """Fragments in the buffer or on the air."""
        self.confirmed = Fragments(image.count)
        """What the camera knows to be at the sink."""
        self.settled = settled
        self.heard_ns = 0
        self.watched = False


class Camera:
    """Takes images and keeps each of them until the sink has it, or it was given up."""

    def __init__(self, shared: Shared, station: Station, phase_ns: int) -> None:
        """``phase_ns`` is when the first image is taken."""
        self.back = shared.env.event()
        """Happens when the node has recovered from a failure, and is renewed then."""
        self._shared = shared
        self._station = station
        self._open: dict[int, Outgoing] = {}
        self._waiting = 0
        self._room = max(1, shared.config.buffer_packets // 2)
        station.camera = self
        shared.book.cameras += 1
        shared.env.process(self._capture(phase_ns))

    def fill(self, buffer: deque[Packet]) -> None:
        """Put the next fragments into the buffer: at most half of it, the rest is for others' packets."""
        shared = self._shared
        for outgoing in self._open.values():
            while outgoing.to_send:
                if self._waiting >= self._room or len(buffer) >= shared.config.buffer_packets:
                    return
                index = outgoing.to_send.popleft()
                packet = shared.book.fragment(outgoing.image, index, self._station.index, shared.destination)
                outgoing.queued.add(index)
                self._waiting += 1
                shared.book.entered(packet, self._station.index)
                buffer.append(packet)

    def sent(self, packet: Packet, ok: bool, confirmed: bool) -> None:
        """A fragment left the node: handed on as far as the node knows (``ok``), or even at the sink."""
        shared = self._shared
        self._waiting -= 1
        outgoing = self._open.get(packet.image)
        if outgoing is None:
            return
        index = outgoing.image.index_of(packet)
        outgoing.queued.discard(index)
        outgoing.heard_ns = int(shared.env.now)
        if confirmed and shared.confirms:
            outgoing.confirmed.add(index)
        elif not ok and shared.config.retransmit:
            outgoing.to_send.append(index)
        all_sent = not outgoing.to_send and not outgoing.queued
        if all_sent and not shared.config.retransmit:
            outgoing.image.sent_once = True
            self._settle(outgoing)
            shared.book.look_for_loss(outgoing.image)
        elif not outgoing.confirmed.lacking:
            self._settle(outgoing)
        elif all_sent and not outgoing.watched:
            outgoing.watched = True
            shared.env.process(self._watch(outgoing))

    def told(self, image: int, missing: tuple[int, ...]) -> None:
        """The sink says what it lacks of an image; nothing if it has it all."""
        outgoing = self._open.get(image)
        if outgoing is None:
            return
        if not missing:
            self._settle(outgoing)
            return
        outgoing.heard_ns = int(self._shared.env.now)
        known = outgoing.queued.union(outgoing.to_send)
        outgoing.to_send.extend(index for index in missing if index not in known)
        self._station.kick()

    def _settle(self, outgoing: Outgoing) -> None:
        """There is nothing more to do for an image."""
        if self._open.pop(outgoing.image.id, None) is not None:
            outgoing.settled.succeed()

    def _watch(self, outgoing: Outgoing) -> Generator[simpy.Event, Any, None]:
        """Send the last fragment again when the sink has been silent for long: it may know nothing of it."""
        env, wait_ns = self._shared.env, 2 * self._shared.quiet_ns
        while outgoing.image.id in self._open:
            quiet_ns = env.now - outgoing.heard_ns
            if quiet_ns >= wait_ns and not outgoing.to_send and not outgoing.queued:
                outgoing.to_send.append(outgoing.image.count - 1)
                outgoing.heard_ns = int(env.now)
                self._station.kick()
                quiet_ns = 0
            yield env.timeout(max(wait_ns - quiet_ns, GUARD_NS))

    def _capture(self, phase_ns: int) -> Generator[simpy.Event, Any, None]:
        shared, config = self._shared, self._shared.config
        taken = 0
        yield shared.env.timeout(phase_ns)
        while config.images == 0 or taken < config.images:
            if shared.failed[self._station.index]:
                yield self.back
                continue
            settled = self._take()
            taken += 1
            if settled is None and config.images == 0 and config.interval_s == 0.0:
                break  # no way to the sink, now or ever: one report is enough
            if config.interval_s:
                yield shared.env.timeout(to_ns(config.interval_s))
            elif settled is not None:
                yield settled
        shared.book.cameras -= 1
        shared.book.look_for_end()

    def _take(self) -> simpy.Event | None:
        """Take an image; the event is that it is settled, None if there is no way to the sink."""
        shared, config = self._shared, self._shared.config
        node = self._station.index
        image = shared.book.capture(node, config.image_bytes + config.depth_bytes)
        if node in shared.unreachable:
            shared.book.close(image, -1, Cause.NO_ROUTE)
            return None
        outgoing = self._open[image.id] = Outgoing(image, shared.env.event())
        if config.deadline_s is not None:
            shared.env.process(self._expire(outgoing, to_ns(config.deadline_s)))
        self._station.kick()
        return outgoing.settled

    def _expire(self, outgoing: Outgoing, deadline_ns: int) -> Generator[simpy.Event, Any, None]:
        yield self._shared.env.timeout(deadline_ns)
        self._settle(outgoing)
        self._shared.book.close(outgoing.image, -1, Cause.DEADLINE)
