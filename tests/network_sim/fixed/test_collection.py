"""Nodes, relays and the sink: what has to arrive arrives, and what cannot is reported."""

import numpy as np
import pytest

from network_sim.config import NetworkConfig
from network_sim.simulate import simulate
from network_sim.trace.conservation import balance, image_balance
from network_sim.types import BEGIN_WITHIN_NS, NS_PER_S, Cause, EventKind, PacketKind, to_ns
from packetmesh.settings import with_settings

LINE = ["nodes.layout=line", "nodes.spacing_m=80", "nodes.image_bytes=5000", "mac.kind=ideal"]
"""Nodes that reach their neighbours only."""


def run(*settings):
    return simulate(with_settings(NetworkConfig(), settings))


def bytes_at(trace, image, peer):
    """Which bytes of an image have been received by ``peer``, and how often."""
    received = trace.events.of(EventKind.RECEIVE)
    mine = (received.image == image) & (received.peer == peer) & (received.packet_kind == PacketKind.IMAGE)
    header_bytes = trace.config.nodes.header_bytes
    counts = np.zeros(trace.config.nodes.image_bytes + trace.config.nodes.depth_bytes, int)
    for first, size in zip(received.first_byte[mine], received.size_bytes[mine], strict=True):
        counts[first : first + size - header_bytes] += 1
    return counts


def test_a_line_of_relays_carries_every_byte_once():
    trace = run(*LINE, "nodes.count=4", "nodes.images=2", "nodes.header_bytes=8", "nodes.depth_bytes=999")
    assert image_balance(trace).received == 8
    for image in range(8):
        np.testing.assert_array_equal(bytes_at(trace, image, peer=4), 1)
    deliveries = trace.events.of(EventKind.DELIVER)
    assert set(np.abs(deliveries.node - deliveries.peer)) == {1, 4}  # the sink is next to node 0
    images = deliveries.packet_kind == PacketKind.IMAGE
    fragments = -(-5999 // 108)
    assert np.count_nonzero(images) == 2 * fragments * (1 + 2 + 3 + 4)


def test_relays_tell_cameras_when_their_image_is_complete():
    trace = run(*LINE, "nodes.count=2", "nodes.images=2")
    status = trace.events.where(trace.events.packet_kind == PacketKind.STATUS).of(EventKind.RECEIVE)
    assert list(status.node) == [2, 2]
    assert list(status.peer) == [1, 1]
    taken = trace.events.of(EventKind.CAPTURE)
    second_ns = taken.t_ns[(taken.node == 1)][1]
    assert second_ns == status.t_ns[0]


@pytest.mark.parametrize("images", [0, 3])
def test_a_disconnected_node_is_reported_and_the_run_ends(images):
    trace = run("nodes.spacing_m=500", f"nodes.images={images}")
    expired = trace.events.of(EventKind.EXPIRE)
    assert set(expired.cause) == {Cause.NO_ROUTE}
    assert len(expired) == 3 * max(images, 1)
    assert trace.horizon_ns <= BEGIN_WITHIN_NS
    assert balance(trace).created == 0


def test_a_disconnected_node_does_not_hold_up_the_others():
    config = with_settings(
        NetworkConfig(),
        ["nodes.layout=random", "nodes.count=8", "nodes.spacing_m=130", "nodes.image_bytes=3000"],
    )
    trace = simulate(config)
    outcome = image_balance(trace)
    assert 0 < outcome.dropped[Cause.NO_ROUTE] < 8
    assert outcome.received == 8 - outcome.dropped[Cause.NO_ROUTE]
    assert trace.horizon_ns < to_ns(config.run.horizon_s)


def test_every_image_is_complete_over_lossy_hops():
    lossy = ["radio.nakagami_m=1", "mac.kind=ieee802154", "nodes.images=2", "nodes.count=3"]
    trace = run(*LINE, *lossy, "run.seed=5")
    assert sum(balance(trace).dropped.values()) > 0
    assert image_balance(trace).received == 6
    for image in range(6):
        assert bytes_at(trace, image, peer=3).min() >= 1


def test_without_acknowledgements_the_sink_asks_for_what_it_lacks():
    trace = run("mac.ack=false", "nodes.image_bytes=8000", "nodes.images=2")
    assert balance(trace).dropped[Cause.COLLISION] > 0
    assert image_balance(trace).received == 6
    received = trace.events.of(EventKind.RECEIVE)
    requests = received.where(received.packet_kind == PacketKind.STATUS)
    assert set(requests.node) == {3}  # the sink
    fragments = np.count_nonzero(received.packet_kind == PacketKind.IMAGE)
    assert balance(trace).created - len(requests) > fragments >= 6 * -(-8000 // 116)


def test_without_retransmission_an_image_with_a_lost_fragment_is_given_up():
    trace = run("nodes.retransmit=false", "nodes.image_bytes=20000", "nodes.images=2")
    outcome = image_balance(trace)
    assert outcome.received == 0
    assert sum(outcome.dropped.values()) == 6
    assert set(outcome.dropped) <= {Cause.CHANNEL, Cause.RETRIES}
    assert balance(trace).created == 6 * -(-20000 // 116)


def test_a_full_relay_drops_and_the_image_is_still_complete():
    crowded = [*LINE, "nodes.count=4", "nodes.buffer_packets=2", "mac.kind=ieee802154"]
    trace = run(*crowded)
    assert balance(trace).dropped[Cause.BUFFER] > 0
    assert image_balance(trace).received == 4
    once = run(*crowded, "nodes.retransmit=false")
    assert Cause.BUFFER in image_balance(once).dropped


def test_an_image_expires_exactly_at_its_deadline():
    trace = run("nodes.deadline_s=20", "nodes.images=2", "run.horizon_s=100")
    taken, expired = trace.events.of(EventKind.CAPTURE), trace.events.of(EventKind.EXPIRE)
    assert set(expired.cause) == {Cause.DEADLINE}
    assert len(expired) == 6
    captured_ns = dict(zip(taken.image, taken.t_ns, strict=True))
    assert [t - captured_ns[i] for t, i in zip(expired.t_ns, expired.image, strict=True)] == [
        20 * NS_PER_S
    ] * 6
    assert balance(trace).dropped[Cause.DEADLINE] > 0
    assert balance(trace).in_flight == 0


def test_nodes_that_cannot_hear_one_another_still_get_through():
    hidden = ["nodes.count=2", "nodes.spacing_m=99", "radio.sense_range_m=100", "nodes.image_bytes=20000"]
    trace = run(*hidden)
    assert image_balance(trace).received == 2
    assert trace.horizon_ns < 20 * NS_PER_S


def test_nodes_that_fail_lose_their_buffer_and_finish_after_their_recovery():
    trace = run("nodes.failures_per_h=120", "nodes.recovery_s=7", "nodes.image_bytes=100000", "run.seed=0")
    down, up = trace.events.of(EventKind.DOWN), trace.events.of(EventKind.UP)
    assert len(down) > 2
    assert set(down.cause) == {Cause.NODE_DOWN}
    for node in range(3):
        gone_ns, back_ns = down.t_ns[down.node == node], up.t_ns[up.node == node]
        assert list(back_ns - gone_ns[: len(back_ns)]) == [7 * NS_PER_S] * len(back_ns)
    assert balance(trace).dropped[Cause.NODE_DOWN] > 0
    assert image_balance(trace).received == 3


def test_a_failed_relay_is_avoided():
    grid = ["nodes.layout=grid", "nodes.count=8", "nodes.spacing_m=90", "mac.kind=ideal"]
    trace = run(*grid, "nodes.image_bytes=20000", "nodes.failures_per_h=200", "nodes.images=3")
    assert image_balance(trace).received == 24
    sent = trace.events.of(EventKind.AIR)
    relays = {
        (int(node), int(peer)) for node, peer in zip(sent.node, sent.peer, strict=True) if node in (3, 4)
    }
    assert len({peer for node, peer in relays if node == 3}) > 1  # node 3 knows two ways to the sink


def test_nobody_sends_while_asleep():
    trace = run("nodes.duty_cycle=0.3", "nodes.duty_period_s=2", "nodes.image_bytes=30000", "nodes.images=2")
    assert image_balance(trace).received == 6
    sent = trace.events.of(EventKind.AIR)
    assert (sent.t_ns % (2 * NS_PER_S) < 0.6 * NS_PER_S).all()
    down = trace.events.of(EventKind.DOWN)
    assert set(down.cause) == {Cause.NONE}
    assert set(down.node) == {0, 1, 2}
    assert set(down.t_ns % (2 * NS_PER_S)) == {to_ns(0.6)}


def test_nodes_awake_for_the_shortest_time_that_is_allowed_deliver_their_images():
    trace = run("nodes.duty_cycle=0.5", "nodes.duty_period_s=0.1", "nodes.image_bytes=2000")
    assert image_balance(trace).received == 3


UPLINK = ["uplink.rate_bps=1000000", "uplink.loss=0.2", "nodes.image_bytes=4000", "mac.kind=ideal"]


def test_what_the_uplink_loses_is_sent_again():
    trace = run(*UPLINK)
    assert trace.names == ("node 1", "node 2", "node 3", "sink", "cloud")
    assert balance(trace).dropped[Cause.UPLINK] > 0
    assert set(trace.events.of(EventKind.ARRIVE).peer) == {4}
    assert image_balance(trace).received == 3
    for image in range(3):
        np.testing.assert_array_equal(bytes_at(trace, image, peer=4), 1)


def test_what_the_uplink_loses_for_good_is_reported():
    trace = run(*UPLINK, "nodes.retransmit=false")
    assert image_balance(trace).dropped == {Cause.UPLINK: 3}


def test_cameras_with_an_interval_take_images_at_their_own_times():
    trace = run("nodes.images=0", "nodes.interval_s=10", "nodes.image_bytes=1000", "run.horizon_s=60")
    taken = trace.events.of(EventKind.CAPTURE)
    phases = [taken.t_ns[taken.node == node] for node in range(3)]
    assert all(set(np.diff(times)) == {10 * NS_PER_S} for times in phases)
    assert len({int(times[0]) for times in phases}) == 3
    assert trace.horizon_ns == 60 * NS_PER_S


def test_the_layout_is_that_of_the_trace():
    trace = run(*LINE, "nodes.count=2", "uplink.rate_bps=1000")
    np.testing.assert_array_equal(trace.positions_m, [[80, 0], [160, 0], [0, 0], [0, 0]])
    assert trace.roles == ("node", "node", "sink", "cloud")
