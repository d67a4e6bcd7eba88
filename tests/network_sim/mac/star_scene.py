"""A medium access between nodes and a sink, without buffers and images, whose events are looked at."""

from __future__ import annotations

from collections.abc import Generator, Iterable
from typing import Any

import numpy as np
import simpy

from network_sim.config import NetworkConfig
from network_sim.mac import make_mac
from network_sim.mac.context import MacContext
from network_sim.mac.medium import Medium
from network_sim.radio.places import FixedPlaces
from network_sim.radio.propagation import Radio
from network_sim.trace.log import Events, Recorder
from network_sim.types import Delivery, Packet, PacketKind


class StarScene:
    """Nodes at given distances from a sink in their middle; ``run`` it and look at the events."""

    def __init__(self, config: NetworkConfig, distances_m: Iterable[float], seed: int = 0) -> None:
        far_m = list(distances_m)
        self.sink = len(far_m)
        angle = 2.0 * np.pi * np.arange(self.sink) / self.sink
        around = np.column_stack([np.cos(angle), np.sin(angle)]) * np.array(far_m)[:, None]
        places = FixedPlaces(np.vstack([around, np.zeros((1, 2))]))
        self.config, self.env = config, simpy.Environment()
        rngs = np.random.default_rng(seed).spawn(3)
        self.radio = Radio(config.radio, config.mac, rngs[0])
        medium = Medium(self.env, self.radio, places, rngs[1])
        self.recorder = Recorder("all", self.sink + 1)
        self.down: set[int] = set()
        self.received: list[tuple[int, int, int]] = []
        """(time in ns, packet, node)."""
        self.outcomes: list[tuple[int, int, Delivery]] = []
        """(time in ns, packet, outcome), when it is known."""
        self.mac = make_mac(
            MacContext(
                self.env,
                medium,
                config,
                self.recorder,
                rngs[2],
                lambda node: node not in self.down,
                lambda packet, node: self.received.append((int(self.env.now), packet.id, node)),
                lambda packet, sender, receiver, delivery: self._note(packet, delivery),
            )
        )

    def _note(self, packet: Packet, delivery: Delivery) -> None:
        self.outcomes.append((int(self.env.now), packet.id, delivery))

    def send(
        self, sender: int, at_ns: int, number: int, size_bytes: int = 100, to: int | None = None
    ) -> None:
        """Let a node send one packet; its id is ``number``."""
        self.send_all(sender, at_ns, [number], size_bytes, to)

    def send_all(
        self,
        sender: int,
        at_ns: int,
        numbers: Iterable[int],
        size_bytes: int = 100,
        to: int | None = None,
    ) -> None:
        """Let a node send packets one after the other, from ``at_ns`` on."""
        receiver = self.sink if to is None else to

        def sending() -> Generator[simpy.Event, Any, None]:
            yield self.env.timeout(at_ns)
            for number in numbers:
                packet = Packet(number, PacketKind.IMAGE, sender, receiver, size_bytes)
                delivery = yield from self.mac.send(packet, sender, receiver)
                if not delivery.under_way:
                    self._note(packet, delivery)

        self.env.process(sending())

    def turn_off(self, node: int, at_ns: int) -> None:
        """Let a node fail."""

        def failing() -> Generator[simpy.Event, Any, None]:
            yield self.env.timeout(at_ns)
            self.down.add(node)

        self.env.process(failing())

    def run(self, until_ns: int | None = None) -> Events:
        """Run until nothing happens any more, or for so long; returns the events."""
        self.env.run(until=until_ns)
        names = tuple(map(str, range(self.sink + 1)))
        trace = self.recorder.trace(self.config, names, None, int(self.env.now), ("node",) * len(names))
        return trace.events
