"""Links of one's own: exact times, and an M/D/1 queue before one."""

from __future__ import annotations

from collections.abc import Generator
from typing import Any, Literal

import numpy as np
import pytest
import simpy
from scipy import stats

from network_sim.config import MacConfig, NetworkConfig
from network_sim.mac import Mac, make_mac
from network_sim.mac.context import MacContext
from network_sim.mac.medium import Medium
from network_sim.radio.places import FixedPlaces
from network_sim.radio.propagation import Radio
from network_sim.trace.log import Recorder
from network_sim.types import NS_PER_S, Cause, Delivery, EventKind, Packet, PacketKind, to_s


def link(
    kind: Literal["ideal", "serial"], link_bps: float, down: tuple[int, ...] = ()
) -> tuple[simpy.Environment, Mac, list[tuple[int, int]], Recorder, NetworkConfig]:
    env = simpy.Environment()
    config = NetworkConfig(mac=MacConfig(kind=kind, link_bps=link_bps))
    recorder = Recorder("all", 2)
    received: list[tuple[int, int]] = []
    rng = np.random.default_rng(0)
    context = MacContext(
        env,
        Medium(env, Radio(config.radio, config.mac, rng), FixedPlaces(np.zeros((2, 2))), rng),
        config,
        recorder,
        rng,
        lambda node: node not in down,
        lambda packet, receiver: received.append((env.now, packet.id)),
    )
    return env, make_mac(context), received, recorder, config


def packet_of(size_bytes: int, number: int = 0) -> Packet:
    return Packet(number, PacketKind.IMAGE, 0, 1, size_bytes)


@pytest.mark.parametrize(
    ("kind", "link_bps", "end_ns"), [("ideal", 250e3, 3_712_000), ("serial", 57_600.0, 20_138_889)]
)
def test_a_packet_takes_its_bits(kind: Literal["ideal", "serial"], link_bps: float, end_ns: int) -> None:
    env, mac, received, recorder, config = link(kind, link_bps)
    sending = env.process(mac.send(packet_of(116), 0, 1))
    assert env.run(sending) == Delivery(True, Cause.NONE, 1)
    assert received == [(end_ns, 0)]
    events = recorder.trace(config, ("node", "sink"), None, env.now, ("node", "sink")).events
    assert events.kind.tolist() == [EventKind.AIR, EventKind.DELIVER]
    assert events.t_ns.tolist() == [0, end_ns]
    assert events.duration_ns.tolist() == [end_ns, 0]


def test_model_b_takes_160_s_an_image() -> None:
    env, mac, received, _, _ = link("serial", 57_600.0)
    env.run(env.process(mac.send(packet_of(921_615), 0, 1)))
    assert to_s(received[0][0]) == pytest.approx(921_615 * 10 / 57_600, abs=1e-9)
    assert round(to_s(received[0][0]), 1) == 160.0


@pytest.mark.parametrize(("down", "attempts"), [((0,), 0), ((1,), 1)])
def test_a_node_that_is_down_neither_sends_nor_receives(down: tuple[int, ...], attempts: int) -> None:
    env, mac, received, _, _ = link("ideal", 1e6, down)
    delivery = env.run(env.process(mac.send(packet_of(100), 0, 1)))
    assert delivery == Delivery(False, Cause.NODE_DOWN, attempts)
    assert received == []


def waits_s(load: float, count: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Waits for an ideal link that takes 1 ms, of packets with Poisson arrivals, and the arrivals in ns."""
    env, mac, _, _, _ = link("ideal", 1e6)
    rng = np.random.default_rng(seed)
    arrivals_ns = np.cumsum(rng.exponential(1e6 / load, count)).astype(np.int64)
    queue = simpy.Store(env)
    began_ns: list[int] = []

    def source() -> Generator[simpy.Event, Any, None]:
        for number, at_ns in enumerate(arrivals_ns.tolist()):
            yield env.timeout(at_ns - env.now)
            queue.put(packet_of(125, number))

    def node() -> Generator[simpy.Event, Any, None]:
        while len(began_ns) < count:
            packet = yield queue.get()
            began_ns.append(env.now)
            yield from mac.send(packet, 0, 1)

    env.process(source())
    env.process(node())
    env.run()
    return (np.array(began_ns) - arrivals_ns) / NS_PER_S, arrivals_ns


def test_each_wait_is_that_of_lindley() -> None:
    waits, arrivals_ns = waits_s(0.8, 2000, 5)
    free_ns, expected = 0, []
    for arrival_ns in arrivals_ns.tolist():
        start_ns = max(arrival_ns, free_ns)
        expected.append((start_ns - arrival_ns) / NS_PER_S)
        free_ns = start_ns + 1_000_000
    assert waits.tolist() == expected


@pytest.mark.parametrize("load", [0.3, 0.7])
def test_mean_wait_is_that_of_an_md1_queue(load: float) -> None:
    means = [float(waits_s(load, 4000, seed)[0][400:].mean()) for seed in range(12)]
    half = stats.t.ppf(0.995, len(means) - 1) * np.std(means, ddof=1) / np.sqrt(len(means))
    expected = load * 1e-3 / (2.0 * (1.0 - load))  # Pollaczek and Khinchine, for a service of 1 ms
    assert abs(np.mean(means) - expected) <= half
    assert half < 0.1 * expected
