"""The sink: assembles images, requests missing fragments, and forwards fragments to the cloud."""

from __future__ import annotations

from collections.abc import Generator
from typing import TYPE_CHECKING, Any

import numpy as np
import simpy

from network_sim.config import UplinkConfig
from network_sim.fixed.images import Image
from network_sim.fixed.nodes import Shared, Station
from network_sim.fixed.requests import Requests
from network_sim.fixed.uplink import Uplink
from network_sim.types import Cause, Packet

if TYPE_CHECKING:
    from network_sim.trace.log import Recorder

ID_BYTES = 4
"""Bytes for the image id and the number of runs in a STATUS packet."""
RUN_BYTES = 4
"""Bytes for the first and last index of a run of consecutive missing fragments."""


class Sink:
    """The sink: destination of all routes, and gateway to the cloud if there is an uplink."""

    def __init__(
        self,
        shared: Shared,
        station: Station,
        uplink: UplinkConfig,
        recorder: Recorder,
        rng: np.random.Generator,
    ) -> None:
        """Create the sink; ``station`` sends STATUS packets, an uplink forwards fragments to the cloud."""
        self._shared = shared
        self._station = station
        self._reported_ns: dict[int, int] = {}
        self._requests = Requests(shared, station) if shared.config.first_bytes_by_node else None
        self._uplink: Uplink | None = None
        if uplink.exists:
            places = shared.sink, shared.destination
            callbacks = self._receive_at_cloud, self._lost_in_uplink
            self._uplink = Uplink(shared.env, uplink, recorder, rng, *places, *callbacks)

    def receive(self, packet: Packet) -> None:
        """Process a fragment that arrived over the radio."""
        book = self._shared.book
        image = book.images[packet.image]
        index = image.index_of(packet)
        new = image.at_sink.add(index)
        if new:
            image.last_news_ns = int(self._shared.env.now)
            if image.count - image.at_sink.missing_count == 1 and self._shared.config.retransmit:
                self._shared.env.process(self._request_missing(image))
        if new and self._uplink is not None:
            self._uplink.put(packet)
        else:
            book.received(packet, self._station.index)
        if not image.at_sink.missing_count:
            if self._uplink is None:
                book.close(image, self._station.index)
            self._report_complete(image)
        if self._requests is not None:
            self._requests.received(image, index, new)

    def _needs_status(self, image: Image) -> bool:
        """Return whether the camera needs STATUS packets to learn which fragments have arrived."""
        shared = self._shared
        return shared.config.retransmit and (not shared.acknowledged or shared.routes.hops(image.node) != 1)

    def _report_complete(self, image: Image) -> None:
        """Send the camera a STATUS that its image is complete; repeat it later if fragments still arrive."""
        now_ns = int(self._shared.env.now)
        last_ns = self._reported_ns.get(image.id)
        due = last_ns is None or now_ns - last_ns >= self._shared.status_after_ns
        if due and self._needs_status(image):
            self._reported_ns[image.id] = now_ns
            self._send_status(image, ())

    def _request_missing(self, image: Image) -> Generator[simpy.Event, Any, None]:
        """Request the missing fragments whenever no new one has arrived for a while."""
        shared = self._shared
        while image.at_sink.missing_count and not image.closed:
            silent_ns = shared.env.now - image.last_news_ns
            if silent_ns >= shared.status_after_ns:
                missing = self._missing_for_status(image)
                if missing and self._needs_status(image):
                    self._send_status(image, missing)
                image.last_news_ns, silent_ns = int(shared.env.now), 0
            yield shared.env.timeout(shared.status_after_ns - silent_ns)

    def _missing_for_status(self, image: Image) -> tuple[int, ...]:
        """Return the missing fragments, limited to the runs that fit into one packet; before the request for
        what follows an image's first bytes, only those of the first bytes.
        """
        config = self._shared.config
        room = max(1, (config.payload_bytes - config.header_bytes - ID_BYTES) // RUN_BYTES)
        waits = self._requests is not None and not self._requests.requested(image)
        missing = image.at_sink.missing(image.first_count if waits else None)
        starts = np.flatnonzero(np.diff(missing, prepend=-2) > 1)
        return tuple(missing[: starts[room]] if len(starts) > room else missing)

    def _send_status(self, image: Image, missing: tuple[int, ...]) -> None:
        shared = self._shared
        runs = int(np.count_nonzero(np.diff(missing, prepend=-2) > 1)) if missing else 0
        size_bytes = ID_BYTES + RUN_BYTES * runs
        packet = shared.book.status_packet(self._station.index, image.node, size_bytes, image.id)
        shared.requested[packet.id] = missing
        self._station.put(packet)

    def _receive_at_cloud(self, packet: Packet, cloud: int) -> None:
        book = self._shared.book
        image = book.images[packet.image]
        image.at_cloud.add(image.index_of(packet))
        book.received(packet, cloud)
        if not image.at_cloud.missing_count:
            book.close(image, cloud)

    def _lost_in_uplink(self, packet: Packet) -> None:
        """Forward the fragment again in a new packet, unless its image is closed."""
        book = self._shared.book
        image = book.images[packet.image]
        if self._uplink is not None and self._shared.config.retransmit and not image.closed:
            index = image.index_of(packet)
            self._uplink.put(book.fragment(image, index, packet.source, packet.destination))
        book.gone(packet, Cause.UPLINK)
