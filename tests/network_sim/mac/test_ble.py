"""Bluetooth LE at 2 Mbit/s: connection events to the microsecond, throughput, retransmission, and refusal."""

from __future__ import annotations

import numpy as np
import pytest

from network_sim.config import NetworkConfig
from network_sim.mac.ble import exchange_ns
from network_sim.mac.saturation import saturation
from network_sim.presets import PRESETS
from network_sim.simulate import simulate
from network_sim.types import Cause, EventKind
from packetmesh.errors import InputError
from packetmesh.settings import with_settings
from tests.network_sim.mac.star_scene import StarScene

US, MS = 1000, 1_000_000
INTERVAL = 30 * MS
PAIR = 1392 * US
"""44 us of the poll, 150, 262 bytes of 4 us, 150."""


def config(*changes: str) -> NetworkConfig:
    return with_settings(PRESETS["ble"], ["nodes.header_bytes=0", *changes])


def test_an_exchange_of_244_bytes_takes_1392_us_which_are_1400_kbit_s():
    assert exchange_ns(244) == PAIR
    assert 244 * 8 / (exchange_ns(244) / 1e9) == pytest.approx(1.4e6, rel=0.002)


def test_an_event_is_a_poll_and_the_nodes_data_by_turns():
    scene = StarScene(config(), [5.0])
    scene.send_all(0, 0, range(3), 244)
    events = scene.run()
    assert events.of(EventKind.ACK).t_ns.tolist() == [0, PAIR, 2 * PAIR]
    assert set(events.of(EventKind.ACK).duration_ns.tolist()) == {44 * US}
    assert events.of(EventKind.AIR).t_ns.tolist() == [194 * US + PAIR * turn for turn in range(3)]
    assert set(events.of(EventKind.AIR).duration_ns.tolist()) == {1048 * US}
    assert [at_ns for at_ns, _, _ in scene.received] == [PAIR * (turn + 1) - 150 * US for turn in range(3)]


def test_a_packet_that_comes_after_its_event_waits_for_the_next():
    scene = StarScene(config(), [5.0])
    scene.send(0, 0, 0, 244)
    scene.send(0, 2 * MS, 1, 244)
    assert scene.run().of(EventKind.ACK).t_ns.tolist() == [0, INTERVAL]


@pytest.mark.parametrize("nodes", [1, 3, 7])
def test_connections_share_the_interval_equally_and_never_overlap(nodes):
    scene = StarScene(config(), [5.0] * nodes)
    for node in range(nodes):
        scene.send_all(node, 0, range(1000 * node, 1000 * node + 100), 244)
    events = scene.run()
    frames = events.of(EventKind.AIR, EventKind.ACK)
    order = np.argsort(frames.t_ns)
    ends_ns = (frames.t_ns + frames.duration_ns)[order]
    assert (frames.t_ns[order][1:] - ends_ns[:-1] >= 150 * US).all()
    share_ns = INTERVAL // nodes
    polls = events.of(EventKind.ACK)
    assert set(((polls.t_ns % INTERVAL) // share_ns - polls.peer).tolist()) == {0}
    counts = np.unique(polls.t_ns // INTERVAL * nodes + polls.peer, return_counts=True)[1]
    assert counts.max() == share_ns // PAIR


@pytest.mark.parametrize(("nodes", "interval_s"), [(1, 0.03), (3, 0.03), (5, 0.05), (2, 0.1)])
def test_the_throughput_is_that_of_whole_exchanges_in_each_event(nodes, interval_s):
    own = config(f"mac.connection_interval_s={interval_s}")
    expected_bps = nodes * (interval_s * 1e9 / nodes // PAIR) * 244 * 8 / interval_s
    assert saturation(own, nodes, 20.0, seed=1).throughput_bps == pytest.approx(expected_bps, rel=0.01)


def test_a_lost_frame_is_sent_again_in_the_next_event_until_it_arrives():
    scene = StarScene(config("loss.share=0.3"), [5.0])
    scene.send_all(0, 0, range(300), 244)
    events = scene.run()
    frames, losses = events.of(EventKind.AIR), events.of(EventKind.LOSS)
    assert [number for _, number, _ in scene.received] == list(range(300))
    assert all(outcome.ok for _, _, outcome in scene.outcomes)
    assert len(losses) == len(frames) - 300
    assert len(losses) / len(frames) == pytest.approx(0.3, abs=0.06)
    ends_ns = (frames.t_ns + frames.duration_ns).tolist()
    for t_ns, number in zip(losses.t_ns, losses.packet, strict=True):
        following = ends_ns.index(t_ns) + 1
        assert frames.packet[following] == number
        assert frames.t_ns[following] == (t_ns // INTERVAL + 1) * INTERVAL + 194 * US


def test_a_node_that_fails_gives_its_packet_up():
    scene = StarScene(config("loss.share=1"), [5.0])
    scene.send(0, 0, 0, 244)
    scene.turn_off(0, 2 * INTERVAL + MS)
    scene.run()
    (outcome,) = [outcome for _, _, outcome in scene.outcomes]
    assert (outcome.ok, outcome.cause, outcome.attempts) == (False, Cause.NODE_DOWN, 3)


def test_beyond_the_range_there_is_no_route_and_no_node_forwards():
    near_far = ["nodes.count=2", "nodes.places_m=25,0,50,0,0,0", "nodes.images=1", "nodes.interval_s=0"]
    events = simulate(config(*near_far)).events
    assert events.of(EventKind.ARRIVE).node.tolist() == [0]
    assert events.of(EventKind.EXPIRE).cause.tolist() == [Cause.NO_ROUTE]


def test_too_many_nodes_for_the_interval_are_one_sentence():
    with pytest.raises(
        InputError, match=r"leaves each of 25 nodes 1\.2 ms, too short for a packet"
    ) as refused:
        simulate(config("nodes.count=25"))
    assert "try a longer interval" in str(refused.value)


@pytest.mark.parametrize("interval_s", [0.005, 0.0076, 5.0])
def test_a_connection_interval_is_a_multiple_of_1250_us(interval_s):
    with pytest.raises(InputError, match=r"mac\.connection_interval_s .* multiple of 0\.00125"):
        config(f"mac.connection_interval_s={interval_s}")


def test_the_sink_sends_in_the_nodes_event_and_the_node_answers():
    scene = StarScene(config(), [5.0, 5.0])
    scene.send_all(2, 0, range(2), 244, to=1)
    events = scene.run()
    offset = INTERVAL // 2
    sent, answers = events.of(EventKind.AIR), events.of(EventKind.ACK)
    assert sent.t_ns.tolist() == [offset, offset + PAIR]
    assert (set(sent.node.tolist()), set(sent.peer.tolist())) == ({2}, {1})
    assert answers.t_ns.tolist() == [offset + 1198 * US, offset + PAIR + 1198 * US]
    assert set(answers.node.tolist()) == {1}
    assert [at_ns for at_ns, _, _ in scene.received] == [offset + 1048 * US, offset + PAIR + 1048 * US]


@pytest.mark.parametrize("begins_ns", [0, 100 * US, 7 * MS, 30 * MS])
def test_a_node_and_the_sink_that_both_send_never_overlap_and_all_arrives(begins_ns):
    scene = StarScene(config("loss.share=0.1"), [5.0, 5.0])
    scene.send_all(0, 0, range(60), 244)
    scene.send_all(2, begins_ns, range(100, 120), 100, to=0)
    events = scene.run()
    frames = events.of(EventKind.AIR, EventKind.ACK)
    order = np.argsort(frames.t_ns)
    ends_ns = (frames.t_ns + frames.duration_ns)[order]
    assert (frames.t_ns[order][1:] - ends_ns[:-1] >= 150 * US).all()
    assert sorted(number for _, number, _ in scene.received) == [*range(60), *range(100, 120)]
    assert (frames.t_ns % INTERVAL + frames.duration_ns <= INTERVAL // 2).all()
