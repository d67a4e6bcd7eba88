"""Network of fixed cameras around one sink: topology, failures and duty cycle (SPEC 6.1)."""

from __future__ import annotations

from collections.abc import Generator
from typing import TYPE_CHECKING, Any

import numpy as np
import simpy
from numpy.typing import NDArray

from network_sim.config import NetworkConfig
from network_sim.fixed.images import Book
from network_sim.fixed.nodes import Camera, Shared, Station
from network_sim.fixed.routing import link_success, shortest_paths
from network_sim.fixed.sink import Sink
from network_sim.mac import make_mac, pace_ns
from network_sim.mac.context import MacContext
from network_sim.mac.medium import Medium
from network_sim.radio.places import FixedPlaces, place_nodes
from network_sim.radio.propagation import Radio
from network_sim.types import BEGIN_WITHIN_NS, Cause, Delivery, EventKind, Packet, PacketKind, to_ns

if TYPE_CHECKING:
    from network_sim.trace.log import Recorder


def disconnected(config: NetworkConfig) -> tuple[str, ...]:
    """Return the names of the nodes without a route to the sink; the network is not run."""
    places, _, success = topology(config)
    names = collection_names(config)
    return tuple(names[node] for node in shortest_paths(success, places.count - 1).unreachable)


def topology(config: NetworkConfig) -> tuple[FixedPlaces, Radio, NDArray[np.float64]]:
    """Return the positions, the radio, and (N, N) success probability of each link, as in a run."""
    return _topology(config, np.random.default_rng(config.run.seed).spawn(1)[0])


def _topology(
    config: NetworkConfig, rng: np.random.Generator
) -> tuple[FixedPlaces, Radio, NDArray[np.float64]]:
    """Return the positions, the radio, and (N, N) success probability of each link."""
    layout_rng, radio_rng = rng.spawn(2)
    places, radio = place_nodes(config.nodes, layout_rng), Radio(config.radio, config.mac, radio_rng)
    return places, radio, link_success(config, radio, places)


def collection_names(config: NetworkConfig) -> tuple[str, ...]:
    """Return the names of the nodes, the sink and the cloud (if there is one), in the order of their ids."""
    cloud = ("cloud",) if config.uplink.exists else ()
    return (*(f"node {node + 1}" for node in range(config.nodes.count)), "sink", *cloud)


class Collection:
    """A network of fixed cameras, simulated by running ``env``."""

    def __init__(
        self, env: simpy.Environment, config: NetworkConfig, recorder: Recorder, rng: np.random.Generator
    ) -> None:
        """Create the network; each source of randomness has its own stream, spawned from ``rng``."""
        ground, medium_rng, mac_rng, self._rng, uplink_rng, pause_rng = rng.spawn(6)
        self._env, self._config, self._recorder = env, config, recorder
        self.places, radio, self._success = _topology(config, ground)
        self.shared = self._make_shared(pause_rng)
        self.stations = [Station(self.shared, node) for node in range(self.places.count)]
        self.names = collection_names(config)
        self._down: list[Cause | None] = [None] * self.places.count
        """Why each node is down: ``NODE_DOWN`` if it failed, ``NONE`` if it sleeps; None if it is up."""
        self._asleep = False
        interval_ns = to_ns(config.nodes.interval_s)
        begin_within_ns = max(BEGIN_WITHIN_NS, self.shared.pace_ns)
        self._cameras = [  # each with its own random time of the first image
            Camera(self.shared, station, int(self._rng.integers(interval_ns or begin_within_ns)))
            for station in self.stations[:-1]
        ]
        self._sink = Sink(self.shared, self.stations[-1], config.uplink, recorder, uplink_rng)
        medium = Medium(env, radio, self.places, medium_rng)
        up = self.shared.up.__getitem__
        context = MacContext(env, medium, config, recorder, mac_rng, up, self._receive, self._report)
        self.shared.mac = make_mac(context)
        if config.nodes.failures_per_h:
            for camera, station in zip(self._cameras, self.stations, strict=False):
                env.process(self._fail_and_recover(camera, station))
        if config.nodes.duty_cycle < 1.0:
            env.process(self._sleep_and_wake())

    def _make_shared(self, rng: np.random.Generator) -> Shared:
        nodes, mac, count = self._config.nodes, self._config.mac, self.places.count
        sink = count - 1
        routes = shortest_paths(self._success, sink)
        return Shared(
            env=self._env,
            config=nodes,
            rng=rng,
            book=Book(
                self._env, self._recorder, nodes.payload_bytes - nodes.header_bytes, nodes.header_bytes
            ),
            routes=routes,
            unreachable=routes.unreachable,
            destination=sink + 1 if self._config.uplink.exists else sink,
            acknowledged=mac.ack or mac.kind not in ("ieee802154", "replay", "lora"),
            failed=[False] * count,
            up=[True] * count,
            pace_ns=pace_ns(self._config),
        )

    @property
    def ended(self) -> simpy.Event:
        """Event that triggers when every image has arrived or was given up, and no packet is left."""
        return self.shared.book.ended

    @property
    def roles(self) -> tuple[str, ...]:
        """Role of each node, in the order of the names."""
        return tuple("node" if name.startswith("node") else name for name in self.names)

    @property
    def positions_m(self) -> np.ndarray:
        """(N, 2) position of each node in the order of the names; the cloud has the sink's position."""
        positions_m = self.places.positions_m
        return np.vstack([positions_m, *(positions_m[-1:] for _ in self.names[len(positions_m) :])])

    @property
    def fraction(self) -> float:
        """Share of the images that have arrived or were given up; 0 without a planned number of images."""
        planned = self._config.nodes.images * self._config.nodes.count
        return sum(image.closed for image in self.shared.book.images) / planned if planned else 0.0

    def _receive(self, packet: Packet, receiver: int) -> None:
        shared = self.shared
        shared.taken.add((packet.id, receiver))
        if receiver == shared.sink:
            self._sink.receive(packet)
        elif receiver == packet.destination:
            shared.book.received(packet, receiver)
            if packet.kind is PacketKind.REQUEST:
                self._cameras[receiver].on_request(packet.image, packet.first_byte)
            else:
                self._cameras[receiver].on_status(packet.image, shared.requested.pop(packet.id))
        else:
            self.stations[receiver].put(packet)

    def _report(self, packet: Packet, sender: int, receiver: int, delivery: Delivery) -> None:
        self.stations[sender].report(packet, receiver, delivery)

    def _fail_and_recover(self, camera: Camera, station: Station) -> Generator[simpy.Event, Any, None]:
        """Run the random failures and recoveries of one node, as a process."""
        env, node, nodes = self._env, station.index, self._config.nodes
        while True:
            yield env.timeout(to_ns(self._rng.exponential(3600.0 / nodes.failures_per_h)))
            self.shared.failed[node] = True
            self._update_state(node)
            self._reroute()
            station.lose_buffer()
            yield env.timeout(to_ns(nodes.recovery_s))
            self.shared.failed[node] = False
            self._update_state(node)
            self._reroute()
            camera.recovered.succeed()
            camera.recovered = env.event()

    def _sleep_and_wake(self) -> Generator[simpy.Event, Any, None]:
        """Run the duty cycle, as a process: all nodes wake and fall asleep together, except the sink."""
        env, nodes = self._env, self._config.nodes
        period_ns = to_ns(nodes.duty_period_s)
        awake_ns = max(1, round(nodes.duty_cycle * period_ns))
        while True:
            self.shared.sleeps_at_ns = int(env.now) + awake_ns
            self._set_asleep(False)
            yield env.timeout(awake_ns)
            self._set_asleep(True)
            yield env.timeout(period_ns - awake_ns)

    def _set_asleep(self, asleep: bool) -> None:
        self._asleep = asleep
        for camera_station in self.stations[:-1]:
            self._update_state(camera_station.index)
        self._wake_all()

    def _update_state(self, node: int) -> None:
        """Record the new state of a node that failed, recovered, woke or fell asleep."""
        state: Cause | None = None
        if self.shared.failed[node]:
            state = Cause.NODE_DOWN
        elif self._asleep:
            state = Cause.NONE
        before, self._down[node] = self._down[node], state
        self.shared.up[node] = state is None
        if before is not state:
            if before is not None:
                self._recorder.add(int(self._env.now), EventKind.UP, node, cause=before)
            if state is not None:
                self._recorder.add(int(self._env.now), EventKind.DOWN, node, cause=state)

    def _reroute(self) -> None:
        """Recompute the routes so that they avoid failed nodes."""
        works = ~np.array(self.shared.failed)
        self.shared.routes = shortest_paths(self._success * np.outer(works, works), self.shared.sink)
        self._wake_all()

    def _wake_all(self) -> None:
        for station in self.stations:
            station.wake()
