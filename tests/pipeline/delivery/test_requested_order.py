"""Deliveries in which the sink requests the order of the nodes' depth tiles."""

from dataclasses import replace

import numpy as np
import pytest

from network_sim.presets import PRESETS
from network_sim.types import EventKind, PacketKind
from packetmesh.errors import InputError
from packetmesh.settings import with_settings
from pipeline.delivery import CODINGS
from pipeline.delivery.left_out import grid_of, pixels_of, tile_bytes, without_tiles
from pipeline.delivery.sending import DeliverySpec, received_at, send
from pipeline.delivery.sink import images_of
from pipeline.delivery.tiled import AVIF, TILE
from pipeline.delivery.worth import order_bytes
from pipeline.folders.delivery import ordered_sentences
from pipeline.io.demos import load_demo
from pipeline.sources import LoadedRig
from pipeline.spec import Spec
from tests.pipeline.delivery.small import CONFIG, small_rig

EXACT = CODINGS["exact"]


def delivery(rig, *settings, preset="office", **fields):
    network = with_settings(PRESETS[preset], settings)
    spec = DeliverySpec(Spec(LoadedRig(rig), config=CONFIG), network, "exact", 6, order="worth")
    return replace(spec, **fields)


@pytest.fixture(scope="module")
def rig():
    return load_demo("living-room")


@pytest.fixture(scope="module")
def sent(rig):
    return send(delivery(rig), rig)


def test_all_tiles_arrive_as_in_the_coding_s_own_order(rig, sent):
    assert sent.left_out is None
    for node, found in enumerate(received_at(sent, int(sent.times_ns[-1]))):
        images = images_of(rig.frames[node])
        stream = np.frombuffer(EXACT.encode(images, sent.packet_bytes), np.uint8)
        assert len(sent.streams[node]) == len(stream)
        there = np.ones(stream.size, np.bool_)
        whole = EXACT.decode(stream, there, images.depth.shape, sent.packet_bytes)
        np.testing.assert_array_equal(found.depth, images.depth)
        np.testing.assert_array_equal(found.rgb, whole.rgb)


def test_at_each_moment_the_sink_has_the_first_tiles_of_the_order(rig, sent):
    """Office loses no packet for good and keeps the order of a node's packets."""
    checked = 0
    for time_ns in sent.times_ns[:-1]:
        for node, found in enumerate(received_at(sent, int(time_ns))):
            images, order = images_of(rig.frames[node]), sent.ordered.worth[node].order
            shape = images.depth.shape
            whole = np.array(
                [
                    np.array_equal(found.depth[area], images.depth[area])
                    for tile in range(order.size)
                    for area in [_area(tile, shape)]
                ]
            )
            with_bytes = order[tile_bytes(images, AVIF).depth.ravel()[order] > 0]
            there = whole[with_bytes]
            count = int(there.sum())
            assert there[:count].all()
            checked += 0 < count < there.size
    assert checked


def _area(tile, shape):
    row, column = divmod(tile, grid_of(shape, TILE)[1])
    return slice(TILE * row, TILE * (row + 1)), slice(TILE * column, TILE * (column + 1))


def test_the_request_of_each_node_is_on_the_air_and_names_one_of_all_orders(rig, sent):
    ordered, trace = sent.ordered, sent.trace
    packets = trace.events.where(trace.events.packet_kind == PacketKind.REQUEST).of(EventKind.AIR)
    assert set(packets.node) == {3}
    sizes = [int((tile_bytes(images_of(frame), AVIF).depth > 0).sum()) for frame in rig.frames]
    assert ordered.request_bytes == tuple(order_bytes(size) for size in sizes)
    assert trace.config.nodes.request_bytes_by_node == ordered.request_bytes
    assert ordered.answered == (True, True, True)
    sentences = ordered_sentences(sent)
    assert len(sentences) == 4
    assert f"{sum(ordered.request_bytes)} bytes" in sentences[0]


def test_tiles_that_are_left_out_are_not_in_the_order_s_bytes(rig):
    both = send(delivery(rig, leave_out_seen=True), rig)
    for node, frame in enumerate(rig.frames):
        images, mask = images_of(frame), both.left_out.tiles[node]
        found = received_at(both, int(both.times_ns[-1]))[node]
        np.testing.assert_array_equal(found.depth, without_tiles(images, mask, AVIF.side_px).depth)
        sent_tiles = ~mask & (tile_bytes(images, AVIF).depth > 0)
        assert both.ordered.request_bytes[node] == order_bytes(int(sent_tiles.sum()))
        assert not found.depth[pixels_of(mask, images.depth.shape, TILE)].any()


def test_one_camera_has_an_order_too():
    small = small_rig(1)
    sending = send(delivery(small), small)
    assert sending.ordered.worth[0] is not None
    last = received_at(sending, int(sending.times_ns[-1]))[0]
    np.testing.assert_array_equal(last.depth, images_of(small.frames[0]).depth)


def test_a_node_that_is_down_has_no_order():
    small = small_rig(2)
    sending = send(delivery(small, down=("node_00",)), small)
    assert sending.ordered.worth[0] is None
    assert sending.ordered.answered == (False, True)
    assert sending.ordered.request_bytes[0] == 0


@pytest.mark.parametrize(
    ("settings", "fields", "names"),
    [
        ((), {"coding": "layered"}, "order of tiles of the coding exact only, not of layered"),
        (("mac.kind=lte-m",), {}, "it cannot tell them the order of their tiles"),
        (("mac.kind=ideal", "nodes.payload_bytes=9000"), {}, "nothing is left to request"),
        ((), {"order": "best"}, "no order 'best' of tiles; try one of own, worth"),
    ],
)
def test_an_order_that_cannot_be_requested_is_one_sentence(settings, fields, names):
    with pytest.raises(InputError) as error:
        delivery(small_rig(), *settings, preset="thesis-link", **fields)
    assert names in str(error.value)
