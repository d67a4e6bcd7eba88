"""The sink: puts images together, says what is lacking, and hands fragments up to the cloud."""

from __future__ import annotations

from collections.abc import Generator
from typing import TYPE_CHECKING, Any

import numpy as np
import simpy

from network_sim.config import UplinkConfig
from network_sim.images import Image
from network_sim.nodes import Shared, Station
from network_sim.types import NS_PER_S, Cause, Packet, to_ns
from network_sim.uplink import Uplink

if TYPE_CHECKING:
    from network_sim.trace import Recorder

ID_BYTES = 4
"""Number of an image, and of the runs that follow, in a STATUS packet."""
RUN_BYTES = 4
"""First and last fragment of a run that is lacking."""


class Sink:
    """Where all routes end."""

    def __init__(self, shared: Shared, station: Station, uplink: UplinkConfig) -> None:
        """``station`` sends what the sink has to tell; see ``join_cloud`` for the uplink."""
        self._shared = shared
        self._station = station
        self._answered_ns: dict[int, int] = {}
        self._uplink: Uplink | None = None
        self._byte_ns = 8 * NS_PER_S / uplink.rate_bps if uplink.rate_bps else 0.0
        self._latency_ns = to_ns(uplink.latency_s)
        self._free_ns = 0
        self._flying: dict[int, tuple[Packet, int]] = {}
        self._watching = False

    def join_cloud(self, uplink: UplinkConfig, recorder: Recorder, rng: np.random.Generator) -> None:
        """From now on fragments go on to the cloud; ``rng`` decides which get lost."""
        shared = self._shared
        self._uplink = Uplink(
            shared.env, uplink, recorder, rng, shared.sink, shared.destination, self._reached_cloud
        )

    def receive(self, packet: Packet) -> None:
        """A fragment has come by radio."""
        book = self._shared.book
        image = book.images[packet.image]
        new = image.at_sink.add(image.index_of(packet))
        if new:
            image.heard_ns = int(self._shared.env.now)
            if image.count - image.at_sink.lacking == 1 and self._shared.config.retransmit:
                self._shared.env.process(self._ask(image))
        if new and self._uplink is not None:
            self._hand_up(packet)
        else:
            book.received(packet, self._station.index)
        if not image.at_sink.lacking:
            if self._uplink is None:
                book.close(image, self._station.index)
            self._confirm(image)

    def _must_tell(self, image: Image) -> bool:
        """Whether the camera cannot know by itself what arrives."""
        shared = self._shared
        return shared.config.retransmit and (not shared.confirms or shared.routes.hops(image.node) != 1)

    def _confirm(self, image: Image) -> None:
        """Tell the camera that its image is complete; now and then again if it goes on sending."""
        now_ns = int(self._shared.env.now)
        last_ns = self._answered_ns.get(image.id)
        if self._must_tell(image) and (last_ns is None or now_ns - last_ns >= self._shared.quiet_ns):
            self._answered_ns[image.id] = now_ns
            self._tell(image, ())

    def _ask(self, image: Image) -> Generator[simpy.Event, Any, None]:
        """Say what is lacking whenever nothing new has come for a while."""
        shared = self._shared
        while image.at_sink.lacking and not image.closed:
            quiet_ns = shared.env.now - image.heard_ns
            if quiet_ns >= shared.quiet_ns:
                if self._must_tell(image):
                    self._tell(image, self._lacking(image))
                image.heard_ns, quiet_ns = int(shared.env.now), 0
            yield shared.env.timeout(shared.quiet_ns - quiet_ns)

    def _lacking(self, image: Image) -> tuple[int, ...]:
        """The missing fragments, as many as one packet can name."""
        config = self._shared.config
        room = max(1, (config.payload_bytes - config.header_bytes - ID_BYTES) // RUN_BYTES)
        missing = image.at_sink.missing()
        starts = np.flatnonzero(np.diff(missing, prepend=-2) > 1)
        return tuple(missing[: starts[room]] if len(starts) > room else missing)

    def _tell(self, image: Image, missing: tuple[int, ...]) -> None:
        shared = self._shared
        runs = int(np.count_nonzero(np.diff(missing, prepend=-2) > 1)) if missing else 0
        packet = shared.book.message(self._station.index, image.node, ID_BYTES + RUN_BYTES * runs, image.id)
        shared.asked[packet.id] = missing
        self._station.put(packet)

    def _hand_up(self, packet: Packet) -> None:
        """Give a packet to the uplink, which keeps order, and note when it must have reached the cloud."""
        assert self._uplink is not None
        now_ns = int(self._shared.env.now)
        self._free_ns = max(now_ns, self._free_ns) + round(packet.size_bytes * self._byte_ns)
        self._flying[packet.id] = packet, self._free_ns + self._latency_ns
        self._uplink.put(packet)
        if not self._watching:
            self._watching = True
            self._shared.env.process(self._watch_uplink())

    def _reached_cloud(self, packet: Packet, cloud: int) -> None:
        book = self._shared.book
        image = book.images[packet.image]
        del self._flying[packet.id]
        image.at_cloud.add(image.index_of(packet))
        book.received(packet, cloud)
        if not image.at_cloud.lacking:
            book.close(image, cloud)

    def _watch_uplink(self) -> Generator[simpy.Event, Any, None]:
        """Notice what the uplink lost, and send it again."""
        env, book = self._shared.env, self._shared.book
        while self._flying:
            packet, due_ns = next(iter(self._flying.values()))
            yield env.timeout(max(due_ns + 1 - env.now, 0))
            if packet.id in self._flying:
                image = book.images[packet.image]
                if self._shared.config.retransmit and not image.closed:
                    index = image.index_of(packet)
                    self._hand_up(book.fragment(image, index, packet.source, packet.destination))
                del self._flying[packet.id]
                book.gone(packet, Cause.UPLINK)
        self._watching = False
