"""Saturation throughput of a medium access, simulated: every node around one sink always has a packet.

There are no buffers and no images, for comparison with Bianchi's model and with ns-3.
"""

from __future__ import annotations

from collections.abc import Generator, Iterator
from dataclasses import dataclass, replace
from itertools import count
from typing import Any

import numpy as np
import simpy

from network_sim.config import WLAN_KINDS, NetworkConfig, RunConfig
from network_sim.mac import Mac, make_mac, make_wlan
from network_sim.mac.context import MacContext
from network_sim.mac.medium import Medium
from network_sim.radio.places import place_nodes
from network_sim.radio.propagation import Radio
from network_sim.trace.counters import Counters
from network_sim.trace.log import Recorder
from network_sim.types import BEGIN_WITHIN_NS, Cause, Delivery, EventKind, Packet, PacketKind, to_ns

WARM_UP = 0.05
"""Share of the duration that is not counted, at the start: the nodes all start within 10 ms."""
_ARRIVED = Cause.NONE, Cause.ACK_LOST


@dataclass(frozen=True, slots=True)
class Saturation:
    """Outcome of a run of saturated nodes."""

    throughput_bps: float
    """Rate at which payload of all nodes reached the sink, without headers above the medium access."""
    delivery_ratio: float
    """Share of packets that reached the sink."""
    packets: int
    """Number of packets that were delivered or dropped."""
    attempts: int
    """Number of data frames sent for these packets."""
    losses: dict[Cause, int]
    """Number of failed attempts, by cause."""
    packets_by_node: tuple[int, ...]
    """Number of each node's packets that reached the sink."""
    kernel_events: int
    """Number of events of the simulation kernel, warm-up included."""


def saturation(
    config: NetworkConfig, nodes: int, duration_s: float, seed: int, wait_after_loss: bool = True
) -> Saturation:
    """Simulate saturated nodes on a circle around a sink, all within range of one another.

    Args:
        config: medium access, radio, and in ``nodes`` the payload, its header and the circle's radius.
        nodes: number of sending nodes.
        duration_s: simulated time, warm-up included.
        seed: random seed; the same seed gives the same result.
        wait_after_loss: False makes IEEE 802.11 wait only a DIFS after a collision, as in Bianchi's model.

    Raises:
        ValueError: ``wait_after_loss`` is False for a medium access other than IEEE 802.11.
    """
    config = replace(
        config,
        nodes=replace(config.nodes, count=nodes, layout="star"),
        run=RunConfig(duration_s, warmup_s=WARM_UP * duration_s, seed=seed, keep="counters"),
    )
    horizon_ns = to_ns(duration_s)
    env = simpy.Environment()
    rngs = [np.random.default_rng(child) for child in np.random.SeedSequence(seed).spawn(5)]
    medium = Medium(
        env, Radio(config.radio, config.mac, rngs[1]), place_nodes(config.nodes, rngs[0]), rngs[2]
    )
    recorder = Recorder(config.run.keep, nodes + 1, to_ns(config.run.warmup_s))
    if not wait_after_loss and config.mac.kind not in WLAN_KINDS:
        raise ValueError(f"{config.mac.kind} has no EIFS")
    ids = count()
    warmup_ns = to_ns(config.run.warmup_s)
    tallies = [_Tally() for _ in range(nodes)]

    def report(packet: Packet, sender: int, receiver: int, delivery: Delivery) -> None:
        if env.now >= warmup_ns:
            tallies[sender].count(delivery)

    context = MacContext(
        env, medium, config, recorder, rngs[3], lambda node: True, lambda packet, node: None, report
    )
    mac = make_mac(context) if wait_after_loss else make_wlan(context, wait_after_loss=False)
    begin_ns = rngs[4].integers(BEGIN_WITHIN_NS, size=nodes).tolist()
    for node, tally in enumerate(tallies):
        env.process(_saturate(env, mac, config, node, ids, tally, begin_ns[node]))
    env.run(until=horizon_ns)
    names, roles = tuple(map(str, range(nodes + 1))), (*["node"] * nodes, "sink")
    trace = recorder.trace(config, names, None, horizon_ns, roles)
    kernel_events = next(env._eid)  # SimPy numbers the events that it schedules
    return _summary(config, trace.counters, tallies, kernel_events)


@dataclass(slots=True)
class _Tally:
    """Numbers of packets of one node after the warm-up."""

    packets: int = 0
    arrived: int = 0

    def count(self, delivery: Delivery) -> None:
        """Count a packet by its outcome."""
        self.packets += 1
        self.arrived += delivery.cause in _ARRIVED


def _summary(
    config: NetworkConfig, counters: Counters, tallies: list[_Tally], kernel_events: int
) -> Saturation:
    """Compute the outcome after the warm-up from counters and tallies."""
    events = counters.count[counters.warmup_minutes :].sum(axis=(0, 2))
    lost = events[EventKind.LOSS]
    packets, arrived = (sum(getattr(tally, key) for tally in tallies) for key in ("packets", "arrived"))
    data_bits = 8 * (config.nodes.payload_bytes - config.nodes.header_bytes)
    duration_s = config.run.horizon_s - config.run.warmup_s
    return Saturation(
        throughput_bps=int(events[EventKind.DELIVER].sum()) * data_bits / duration_s,
        delivery_ratio=arrived / packets if packets else 0.0,
        packets=packets,
        attempts=int(events[EventKind.AIR].sum()),
        losses={cause: int(lost[cause]) for cause in Cause if lost[cause]},
        packets_by_node=tuple(tally.arrived for tally in tallies),
        kernel_events=kernel_events,
    )


def _saturate(
    env: simpy.Environment,
    mac: Mac,
    config: NetworkConfig,
    node: int,
    ids: Iterator[int],
    tally: _Tally,
    begin_ns: int,
) -> Generator[simpy.Event, Any, None]:
    """Send the next packet of a node as soon as the last is delivered or dropped, without end."""
    sink, size_bytes, warmup_ns = config.nodes.count, config.nodes.payload_bytes, to_ns(config.run.warmup_s)
    kind = PacketKind.IMAGE  # slow to look up for every packet
    yield env.timeout(begin_ns)
    while True:
        delivery = yield from mac.send(Packet(next(ids), kind, node, sink, size_bytes), node, sink)
        if env.now >= warmup_ns and not delivery.under_way:
            tally.count(delivery)
