"""Nodes that send the first bytes of their images, and the others when the sink has requested them."""

import numpy as np
import pytest

from network_sim.metrics.arrivals import arrivals
from network_sim.presets import PRESETS
from network_sim.simulate import simulate
from network_sim.trace.conservation import image_balance
from network_sim.types import Cause, EventKind, PacketKind, to_ns
from packetmesh.errors import InputError
from packetmesh.settings import with_settings

SIZES = "nodes.bytes_by_node=9000,8000,7000"
FIRST = (3000, 2500, 2001)
WAITING = (SIZES, "nodes.first_bytes_by_node=3000,2500,2001", "nodes.request_bytes_by_node=38,150,0")
HIDDEN = ("nodes.layout=line", "nodes.spacing_m=80")
"""Nodes that reach their neighbours only."""


def run(*settings, preset="thesis-link"):
    return simulate(with_settings(PRESETS[preset], ["nodes.images=1", *settings]))


def requests(trace, kind=EventKind.RECEIVE):
    return trace.events.where(trace.events.packet_kind == PacketKind.REQUEST).of(kind)


@pytest.mark.parametrize(
    ("preset", "settings"),
    [
        ("thesis-link", ()),
        ("thesis-link", ("mac.ack=false", "loss.share=0.1")),
        ("thesis-link", HIDDEN),
        ("thesis-link", ("mac.kind=ideal", "nodes.retransmit=false")),
        ("office", ("nodes.deadline_s=none",)),
        ("lora", ()),
        ("ble", ("nodes.deadline_s=none", "loss.share=0.1")),
        ("greenhouse", ("nodes.count=3", "nodes.deadline_s=none")),
    ],
)
def test_the_others_follow_the_request_that_follows_the_first_bytes_of_all(preset, settings):
    trace = run(*settings, *WAITING, "nodes.request_after_s=0.5", preset=preset)
    came = arrivals(trace)
    assert [int(came.byte_count[came.node == node].sum()) for node in range(3)] == [9000, 8000, 7000]
    data_bytes = trace.config.nodes.payload_bytes - trace.config.nodes.header_bytes
    first = np.array([-(-size // data_bytes) * data_bytes for size in FIRST])
    early = came.first_byte < first[came.node]
    asked = requests(trace, EventKind.ENQUEUE)
    begun_ns = asked.t_ns[asked.node == len(FIRST)].min()
    assert came.t_ns[early].max() <= begun_ns - to_ns(0.5)
    answered = requests(trace)
    frames = trace.events.where(trace.events.packet_kind == PacketKind.IMAGE).of(EventKind.AIR)
    for node in range(3):
        released_ns = answered.t_ns[answered.peer == node].min()
        mine = (frames.node == node) & (frames.image == came.image[came.node == node][0])
        assert frames.t_ns[mine & (frames.first_byte >= first[node])].min() >= released_ns > begun_ns


def test_a_request_has_the_bytes_of_its_packets_and_takes_the_air():
    trace = run(*WAITING)
    asked = requests(trace, EventKind.ENQUEUE)
    sizes = {node: sorted(set(asked.size_bytes[asked.image == _image_of(trace, node)])) for node in range(3)}
    assert sizes == {0: [42], 1: [42, 116], 2: [4]}  # 150 = 112 + 38, each with 4 bytes of its own
    assert len(requests(trace, EventKind.AIR)) >= 4


def _image_of(trace, node):
    taken = trace.events.of(EventKind.CAPTURE)
    return int(taken.image[taken.node == node][0])


def test_a_node_without_a_route_is_not_waited_for():
    trace = run(*WAITING, "nodes.places_m=0,20,20,0,0,-900,0,0")
    assert image_balance(trace).received == 2
    assert trace.horizon_ns < 5e9


def test_where_nothing_is_sent_again_the_sink_decides_after_a_silence_and_every_node_gets_its_request():
    lossy = ("mac.ack=false", "nodes.retransmit=false", "loss.share=0.3", "loss.burst_packets=8")
    trace = run(*WAITING, *lossy)
    assert set(requests(trace).peer.tolist()) == {0, 1, 2}
    came, asked = arrivals(trace), requests(trace, EventKind.ENQUEUE)
    first_ns = asked.t_ns.min()
    before = came.t_ns[came.t_ns < first_ns]
    assert first_ns - before.max() >= 2_000_000_000 + to_ns(trace.config.nodes.request_after_s)
    assert came.t_ns.max() > first_ns


def test_a_lost_request_is_sent_again():
    trace = run(*WAITING, "mac.kind=ideal", "loss.share=0.5")
    assert requests(trace, EventKind.DROP).cause.tolist().count(Cause.LINK) > 0
    assert image_balance(trace).received == 3


def test_a_node_with_nothing_but_first_bytes_is_done_with_its_request():
    whole = "nodes.first_bytes_by_node=9000,8000,7000"
    trace = run(SIZES, whole, "nodes.request_bytes_by_node=0,0,0")
    assert image_balance(trace).received == 3
    assert trace.horizon_ns < 10e9


def test_until_the_request_a_run_does_not_depend_on_what_follows():
    one, other = run(*WAITING), run(*WAITING, "nodes.bytes_by_node=9000,4000,2088")  # 18 whole packets
    first_ns = requests(one, EventKind.ENQUEUE).t_ns.min()
    assert first_ns == requests(other, EventKind.ENQUEUE).t_ns.min()
    before = [trace.events.of(EventKind.AIR) for trace in (one, other)]
    columns = [
        np.stack([frames.t_ns, frames.node, frames.first_byte])[:, frames.t_ns < first_ns]
        for frames in before
    ]
    np.testing.assert_array_equal(*columns)


@pytest.mark.parametrize(
    ("settings", "names"),
    [
        (("nodes.first_bytes_by_node=1,1,1",), "belong together"),
        ((*WAITING, "nodes.images=2"), "nodes.images is 2"),
        ((*WAITING, "nodes.bytes_by_node=9000,8000,2000"), "2001 for node 3, whose image has 2000"),
        ((*WAITING, "mac.kind=lte-m", "nodes.payload_bytes=100"), "mac.kind is lte-m"),
        ((*WAITING, "mac.kind=lora"), "mac.kind is lora with mac.ack"),
    ],
)
def test_settings_that_contradict_each_other_are_one_sentence(settings, names):
    with pytest.raises(InputError) as error:
        with_settings(PRESETS["thesis-link"], settings)
    assert names in str(error.value)
