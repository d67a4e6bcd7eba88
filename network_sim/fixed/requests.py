"""Requests of the sink for what follows the first bytes of the nodes' images (``nodes.first_bytes_by_node``).

The sink waits for the first bytes of all nodes that have a route, because what it requests of one may depend
on what it has of the others. Where some do not come it waits until no new ones have come for a while. A node
whose request is late sends its last fragment again, which the sink answers by the request.
"""

from __future__ import annotations

from collections.abc import Generator
from typing import Any

import simpy

from network_sim.fixed.images import Image, request_packets_bytes
from network_sim.fixed.nodes import Shared, Station
from network_sim.types import Cause, Packet, PacketKind, to_ns

MOST_SILENCES = 4
"""If no new first bytes arrive for this many times ``Shared.status_after_ns``, the sink decides without the
missing ones. Cameras that send lost packets again repeat their last fragment after twice ``status_after_ns``,
so it can still arrive. If nodes send nothing again, the sink waits for one such time only."""

ON_AIR = (Cause.CHANNEL, Cause.RETRIES, Cause.LINK)
"""Causes for which the medium access gives up a packet that can be sent again at once."""


class Requests:
    """The sink's state: the first bytes that it waits for, and the time of its request to each node."""

    def __init__(self, shared: Shared, station: Station) -> None:
        """Start waiting; ``station`` sends the requests."""
        self._shared, self._station = shared, station
        self._awaited = set(range(shared.config.count)) - set(shared.unreachable)
        self._decided = self._requesting = False
        self._last_news_ns = -1
        self._requested_ns: dict[int, int] = {}
        """Time of the newest request, by image."""
        station.on_given_up = self._send_again

    def requested(self, image: Image) -> bool:
        """Return whether the sink has requested what follows an image's first bytes."""
        return image.id in self._requested_ns

    def received(self, image: Image, index: int, new: bool) -> None:
        """Process fragment ``index`` of an image, which the sink may have had before."""
        if index >= image.first_count:
            return
        now_ns = int(self._shared.env.now)
        if new:
            if self._last_news_ns < 0:
                self._shared.env.process(self._stop_waiting())
            self._last_news_ns = now_ns
        if not image.at_sink.missing(image.first_count):
            self._awaited.discard(image.node)
        if self._requesting:
            self._request(image)
        elif not self._awaited:
            self._decide()

    def _stop_waiting(self) -> Generator[simpy.Event, Any, None]:
        """Decide without what is missing after a time without news, as a process."""
        shared = self._shared
        while not self._decided:
            most_ns = shared.status_after_ns * (MOST_SILENCES if shared.config.retransmit else 1)
            silent_ns = shared.env.now - self._last_news_ns
            if silent_ns >= most_ns:
                self._decide()
                return
            yield shared.env.timeout(most_ns - silent_ns)

    def _decide(self) -> None:
        if not self._decided:
            self._decided = True
            self._shared.env.process(self._request_all())

    def _request_all(self) -> Generator[simpy.Event, Any, None]:
        """Compute the requests and send them, as a process."""
        yield self._shared.env.timeout(to_ns(self._shared.config.request_after_s))
        self._requesting = True
        for image in self._shared.book.images:
            self._request(image)

    def _request(self, image: Image) -> None:
        """Send a node the request, unless it was sent a short time ago or the image was given up."""
        shared, now_ns = self._shared, int(self._shared.env.now)
        last_ns = self._requested_ns.get(image.id)
        if _given_up(image) or (last_ns is not None and now_ns - last_ns < shared.status_after_ns):
            return
        self._requested_ns[image.id] = now_ns
        for number, data_bytes in enumerate(request_packets_bytes(shared.config, image.node)):
            self._station.put(
                shared.book.request_packet(self._station.index, image.node, data_bytes, image.id, number)
            )

    def _send_again(self, packet: Packet, cause: Cause) -> None:
        """Send a packet of a request again that the radio has given up, if lost packets are sent again."""
        shared = self._shared
        if packet.kind is not PacketKind.REQUEST or cause not in ON_AIR or not shared.config.retransmit:
            return
        image = shared.book.images[packet.image]
        if not _given_up(image):
            self._station.put(
                shared.book.request_packet(
                    packet.source, image.node, packet.byte_count, image.id, packet.first_byte
                )
            )


def _given_up(image: Image) -> bool:
    return image.closed and bool(image.at_sink.missing_count)
