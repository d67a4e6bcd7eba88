"""The hop to the cloud: rate, queue, latency and loss."""

from __future__ import annotations

import numpy as np
import pytest
import simpy
from scipy import stats

from network_sim.config import NetworkConfig, UplinkConfig
from network_sim.fixed.uplink import Uplink
from network_sim.trace.log import Events, Recorder
from network_sim.types import Cause, EventKind, Packet, PacketKind
from packetmesh.errors import InputError

MS = 1_000_000
SINK, CLOUD = 0, 1


def packet_of(number: int, size_bytes: int = 1000) -> Packet:
    return Packet(number, PacketKind.IMAGE, SINK, CLOUD, size_bytes)


class Hop:
    """An uplink with what has arrived over it."""

    def __init__(self, config: UplinkConfig, seed: int = 0) -> None:
        self.env = simpy.Environment()
        self.recorder = Recorder("all", 2)
        self.arrived: list[tuple[int, int]] = []
        self.lost: list[int] = []
        rng = np.random.default_rng(seed)
        self.uplink = Uplink(self.env, config, self.recorder, rng, SINK, CLOUD, self._receive, self._lose)

    def _receive(self, packet: Packet, node: int) -> None:
        assert node == CLOUD
        self.arrived.append((self.env.now, packet.id))

    def _lose(self, packet: Packet) -> None:
        self.lost.append(packet.id)

    def put(self, packet: Packet, at_ns: int) -> None:
        self.env.timeout(at_ns).callbacks.append(lambda _: self.uplink.put(packet))

    def run(self) -> Events:
        self.env.run()
        names = ("sink", "cloud")
        return self.recorder.trace(NetworkConfig(), names, None, self.env.now, names).events


def test_packets_queue_for_the_rate_and_travel_at_the_same_time() -> None:
    hop = Hop(UplinkConfig(rate_bps=80e3, latency_s=0.15))
    for number, at_ns in enumerate((0, 10 * MS, 20 * MS, 900 * MS)):
        hop.put(packet_of(number), at_ns)
    events = hop.run()
    assert hop.arrived == [(250 * MS, 0), (350 * MS, 1), (450 * MS, 2), (1150 * MS, 3)]
    delivered = events.of(EventKind.DELIVER)
    assert delivered.t_ns.tolist() == [250 * MS, 350 * MS, 450 * MS, 1150 * MS]
    assert delivered.duration_ns.tolist() == [100 * MS] * 4
    assert events.of(EventKind.ENQUEUE).t_ns.tolist() == [0, 10 * MS, 20 * MS, 900 * MS]
    assert len(events) == 8


def test_what_gets_lost_is_dropped_and_nothing_else() -> None:
    hop = Hop(UplinkConfig(rate_bps=1e9, latency_s=0.0, loss=0.3))
    for number in range(2000):
        hop.uplink.put(packet_of(number))
    events = hop.run()
    dropped = events.of(EventKind.DROP)
    assert set(dropped.cause.tolist()) == {Cause.UPLINK}
    arrived = [number for _, number in hop.arrived]
    assert arrived == sorted(arrived)
    assert sorted(arrived + dropped.packet.tolist()) == list(range(2000))
    assert stats.binomtest(len(dropped), 2000, 0.3).pvalue > 0.001
    lost = events.of(EventKind.LOSS)
    assert lost.packet.tolist() == dropped.packet.tolist() == hop.lost


@pytest.mark.parametrize(("loss", "arrived"), [(0.0, 50), (1.0, 0)])
def test_limits_of_loss(loss: float, arrived: int) -> None:
    hop = Hop(UplinkConfig(rate_bps=1e6, loss=loss))
    for number in range(50):
        hop.uplink.put(packet_of(number))
    hop.run()
    assert len(hop.arrived) == arrived


def test_the_same_seed_loses_the_same_packets() -> None:
    first, second, other = (Hop(UplinkConfig(rate_bps=1e6, loss=0.5), seed) for seed in (7, 7, 8))
    for hop in (first, second, other):
        for number in range(100):
            hop.uplink.put(packet_of(number))
        hop.run()
    assert first.arrived == second.arrived != other.arrived


def test_an_uplink_without_a_rate_is_refused() -> None:
    with pytest.raises(InputError, match=r"uplink\.rate_bps"):
        Hop(UplinkConfig())
