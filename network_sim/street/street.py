"""The street scenario: vehicles exchange summaries, requests and images with roadside access points.

Our reconstruction (SPEC 6.2) of the scenario of Bruno & Nurchis, "Efficient data collection in multimedia
vehicular sensing platforms" (arXiv 1311.6013), of which only the abstract and the first lines could be read.
A vehicle within range of an access point sends the tags of its new images every 10 s; the collector behind
the access points, wired to them without delay, requests some of the images; the vehicle sends these. Images
that were requested but did not arrive are offered again while they are in the vehicle's buffer.
"""

from __future__ import annotations

from collections.abc import Generator
from itertools import count
from typing import Any

import numpy as np
import simpy

from network_sim.config import NetworkConfig
from network_sim.mac import make_mac
from network_sim.mac.context import MacContext
from network_sim.mac.medium import Medium
from network_sim.radio.propagation import Radio, reach_m
from network_sim.settings.street import RANGE_BYTES
from network_sim.street.mobility import (
    Contact,
    Routes,
    StreetPlaces,
    access_points_m,
    cell_numbers,
    contacts,
    drive,
    random_streams,
    routes_of,
)
from network_sim.street.pieces import Cuts, Part
from network_sim.street.schemes import make_scheme
from network_sim.street.snapshots import Snapshots
from network_sim.trace.log import Recorder
from network_sim.types import EventKind, Packet, PacketKind, to_ns

_ENQUEUE, _RECEIVE, _ARRIVE = EventKind.ENQUEUE, EventKind.RECEIVE, EventKind.ARRIVE
_IMAGE = PacketKind.IMAGE
"""Local names, because enumeration members are slow to look up and these are used for every packet."""


def start_street(
    env: simpy.Environment, config: NetworkConfig, recorder: Recorder, rng: np.random.Generator
) -> Street:
    """Start all vehicles; the caller runs ``env`` to the horizon, then calls ``Street.record_images``."""
    driving, cameras, requests, radio_rng, medium_rng, mac_rng = random_streams(rng)
    routes = drive(config.street, config.run.horizon_s, driving)
    medium = Medium(env, Radio(config.radio, config.mac, radio_rng), _places(routes), medium_rng)
    snapshots = Snapshots(config, routes, cameras)
    street = Street(medium, config, recorder, snapshots, requests, mac_rng)
    points_m = access_points_m(config.street)
    for vehicle, meetings in enumerate(contacts(routes, points_m, reach_m(config))):
        env.process(street.follow(vehicle, meetings))
    return street


def street_of(config: NetworkConfig) -> StreetPlaces:
    """Return the nodes' positions over time in the street-grid run of this config, without running it."""
    return _places(routes_of(config))


def _places(routes: Routes) -> StreetPlaces:
    return StreetPlaces(routes, access_points_m(routes.config))


class Street:
    """Vehicles (nodes 0 to V - 1), access points (V to V + A - 1), and the collector wired to them."""

    def __init__(
        self,
        medium: Medium,
        config: NetworkConfig,
        recorder: Recorder,
        snapshots: Snapshots,
        rng: np.random.Generator,
        mac_rng: np.random.Generator,
    ) -> None:
        """Create the nodes; ``rng`` draws the requests of the scheme, ``mac_rng`` the backoffs."""
        vehicles, points = config.street.vehicles, config.street.access_points
        self.names = tuple(
            [f"vehicle {i + 1}" for i in range(vehicles)] + [f"access point {i + 1}" for i in range(points)]
        )
        self.roles = ("vehicle",) * vehicles + ("access-point",) * points
        self._env = env = medium.env
        self._config = config.scheme
        self._recorder = recorder
        self._snapshots = snapshots
        self._scheme = make_scheme(config.scheme, cell_numbers(config.street, config.scheme.cell_m), rng)
        self._downlinks = [simpy.Resource(env) for _ in range(points)]
        self._ids = count()
        self._arrived = [-1] * len(self.names)
        self._cuts = Cuts(config.scheme)
        self._whole = self._cuts.datagrams(0, self._cuts.pieces)
        self._sending = [(0, 0)] * len(self.names)
        """First byte and byte after the last of the image, or part of it, that each node sends."""
        self._interval_ns = to_ns(config.scheme.summary_interval_s)
        always_up = ([True] * len(self.names)).__getitem__
        self._mac = make_mac(MacContext(env, medium, config, recorder, mac_rng, always_up, self._receive))

    def follow(self, vehicle: int, meetings: list[Contact]) -> Generator[simpy.Event, Any, None]:
        """Run one vehicle as a process: repeat the exchange in each contact until it is out of range."""
        env, record = self._env, self._recorder.add
        for contact in meetings:
            yield env.timeout(max(contact.enter_ns - env.now, 0))
            next_ns = int(env.now)
            if next_ns >= contact.leave_ns:
                continue
            access_point = len(self.names) - len(self._downlinks) + contact.access_point
            record(next_ns, EventKind.JOIN, vehicle, access_point)
            while next_ns < contact.leave_ns:
                yield env.timeout(next_ns - env.now)
                next_ns += self._interval_ns
                yield from self._exchange(vehicle, access_point, contact.leave_ns)
                next_ns = max(next_ns, int(env.now))
            yield env.timeout(max(contact.leave_ns - env.now, 0))
            record(contact.leave_ns, EventKind.LEAVE, vehicle, access_point)

    def record_images(self) -> None:
        """Record all images taken and all images dropped from buffers; call once, at the end of the run."""
        self._snapshots.record(self._recorder, int(self._env.now), self._config.image_bytes)

    def _exchange(self, vehicle: int, access_point: int, leave_ns: int) -> Generator[simpy.Event, Any, None]:
        """Exchange one summary, the request that answers it, and the upload."""
        env, scheme, snapshots = self._env, self._scheme, self._snapshots
        offered = snapshots.offer(vehicle, int(env.now))
        heard = yield from self._send_summary(vehicle, access_point, leave_ns, offered)
        cells, captured_ns = snapshots.tags(vehicle, heard)
        shown = snapshots.pieces(vehicle, captured_ns) if scheme.by_pieces else cells
        parts = scheme.parts(shown, captured_ns, int(env.now))
        requested = len(parts)
        if scheme.on_request:
            requested = yield from self._send_request(vehicle, access_point, len(parts))
        rows = [part.row for part in parts]
        images, taken_ns = heard[rows].tolist(), captured_ns[rows].tolist()
        sent = yield from self._upload(vehicle, access_point, leave_ns, images[:requested], taken_ns, parts)
        missed = set(images).difference(sent)
        for image, part, image_ns in zip(images, parts, taken_ns, strict=True):
            for cell in part.shows:
                if image in missed:
                    scheme.missed(cell, image_ns)
                else:
                    scheme.received(cell, int(env.now))
        snapshots.offer_later(vehicle, missed.union(set(offered.tolist()).difference(heard.tolist())))

    def _send_summary(
        self, vehicle: int, access_point: int, leave_ns: int, images: np.ndarray
    ) -> Generator[simpy.Event, Any, np.ndarray]:
        """Send the tags of images (T,); returns the images whose tags arrived."""
        config = self._config
        most = config.datagram_bytes // config.tag_bytes
        heard = [images[:0]]
        for first in range(0, len(images), most):
            tags = images[first : first + most]
            if self._env.now >= leave_ns:
                break
            size_bytes = len(tags) * config.tag_bytes
            arrived = yield from self._send(PacketKind.SUMMARY, vehicle, access_point, size_bytes)
            if arrived:
                heard.append(tags)
        return np.concatenate(heard)

    def _send_request(self, vehicle: int, access_point: int, ids: int) -> Generator[simpy.Event, Any, int]:
        """Send a request with ``ids`` image ids; returns the number of leading ids that arrived."""
        config = self._config
        id_bytes = config.id_bytes + (RANGE_BYTES if self._scheme.by_pieces else 0)
        most = config.datagram_bytes // id_bytes
        downlink = self._downlinks[access_point - len(self.names)]
        for first in range(0, ids, most):
            size_bytes = min(most, ids - first) * id_bytes
            with downlink.request() as slot:
                yield slot
                arrived = yield from self._send(PacketKind.REQUEST, access_point, vehicle, size_bytes)
            if not arrived:
                return first
        return ids

    def _upload(
        self,
        vehicle: int,
        access_point: int,
        leave_ns: int,
        images: list[int],
        taken_ns: list[int],
        parts: list[Part],
    ) -> Generator[simpy.Event, Any, list[int]]:
        """Send parts of images while in range and while in the buffer; returns the images received."""
        env, cuts, kept_ns = self._env, self._cuts, self._snapshots.kept_ns
        sent: list[int] = []
        for image, image_ns, (_, _, first, stop) in zip(images, taken_ns, parts, strict=False):
            stop = cuts.pieces if stop is None else stop
            header_bytes = cuts.header_bytes(first, stop)
            datagrams = self._whole if not header_bytes else cuts.datagrams(first, stop)
            self._sending[vehicle] = cuts.edges[first], cuts.edges[stop]
            for first_byte, size_bytes in datagrams:
                if env.now >= leave_ns:
                    return sent
                if env.now >= image_ns + kept_ns:
                    break
                arrived = yield from self._send(
                    _IMAGE, vehicle, access_point, size_bytes, image, first_byte, header_bytes
                )
                if not arrived:
                    break
            else:
                sent.append(image)
        return sent

    def _send(
        self,
        kind: PacketKind,
        source: int,
        destination: int,
        size_bytes: int,
        image: int = -1,
        first_byte: int = 0,
        header_bytes: int = 0,
    ) -> Generator[simpy.Event, Any, bool]:
        """Send one datagram; returns whether it arrived."""
        now_ns = int(self._env.now)
        whole_bytes = size_bytes + header_bytes + self._config.headers_bytes
        number = next(self._ids)
        packet = Packet(number, kind, source, destination, whole_bytes, image, first_byte, size_bytes)
        record = self._recorder.add_packet
        record(now_ns, _ENQUEUE, packet, source, destination, whole_bytes)
        delivery = yield from self._mac.send(packet, source, destination)
        if self._arrived[source] == number:
            return True
        now_ns, cause = int(self._env.now), delivery.cause
        record(now_ns, EventKind.DROP, packet, source, destination, whole_bytes, cause)
        return False

    def _receive(self, packet: Packet, node: int) -> None:
        """Record that a packet reached a node, which in this scenario is always its destination."""
        now_ns = int(self._env.now)
        source, image = packet.source, packet.image
        self._arrived[source] = packet.id
        self._recorder.add_packet(now_ns, _RECEIVE, packet, source, node, packet.size_bytes)
        # Fragments are sent in order, none after a lost one: the last one completes its image.
        first_byte, end_byte = self._sending[source]
        if image >= 0 and packet.first_byte + packet.byte_count == end_byte:
            self._snapshots.arrived[image] = True
            size_bytes = end_byte - first_byte
            self._recorder.add(now_ns, _ARRIVE, source, node, packet.id, image, first_byte, size_bytes)
