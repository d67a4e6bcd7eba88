"""Deliveries in which the sink tells nodes the tiles that another camera has shown."""

from dataclasses import replace

import numpy as np
import pytest

from network_sim.presets import PRESETS
from network_sim.types import EventKind, PacketKind, to_ns
from packetmesh.errors import InputError
from packetmesh.progress import drain
from packetmesh.settings import with_settings
from pipeline.delivery import CODINGS
from pipeline.delivery.left_out import (
    base_view,
    grid_of,
    pixels_of,
    tile_bytes,
    whole_tiles,
    without_tiles,
)
from pipeline.delivery.moments import Rebuilder
from pipeline.delivery.sending import DeliverySpec, received_at, send
from pipeline.delivery.shared_views import shared_views
from pipeline.delivery.sink import images_of, units_per_m
from pipeline.delivery.tiled import AVIF
from pipeline.io.demos import load_demo
from pipeline.kernels.geometry import rotation_exp
from pipeline.sources import LoadedRig
from pipeline.spec import Spec
from pipeline.types import Rig
from tests.pipeline.delivery.small import CONFIG, small_rig

EXACT = CODINGS["exact"]


def delivery(rig, *settings, preset="thesis-link", **fields):
    network = with_settings(PRESETS[preset], settings)
    spec = DeliverySpec(Spec(LoadedRig(rig), config=CONFIG), network, "exact", 2, leave_out_seen=True)
    return replace(spec, **fields)


@pytest.fixture(scope="module")
def rig():
    return load_demo("living-room")


@pytest.fixture(scope="module")
def sent(rig):
    return send(delivery(rig), rig)


def requests(trace, kind):
    return trace.events.where(trace.events.packet_kind == PacketKind.REQUEST).of(kind)


def test_what_is_left_out_and_what_is_sent_make_all(rig, sent):
    left_out = sent.left_out
    assert sum(left_out.left_out_bytes) > 0.1 * sum(left_out.whole_bytes)
    packet = sent.packet_bytes
    for node, frame in enumerate(rig.frames):
        images = images_of(frame)
        whole, stream = left_out.whole_bytes[node], sent.streams[node]
        assert whole == len(EXACT.encode(images, packet)) == len(stream) + left_out.left_out_bytes[node]
        tiles = sum(tile_bytes(images, AVIF).of(left_out.tiles[node]))
        with_repair = tiles * EXACT.repair_every / (EXACT.repair_every - 1)
        assert tiles - packet <= left_out.left_out_bytes[node] <= with_repair + packet


def test_the_sink_has_the_other_tiles_exactly_and_those_left_out_as_in_the_base_layer(rig, sent):
    last = received_at(sent, int(sent.times_ns[-1]))
    for node, (frame, found) in enumerate(zip(rig.frames, last, strict=True)):
        images, mask = images_of(frame), sent.left_out.tiles[node]
        expected = without_tiles(images, mask, AVIF.side_px)
        np.testing.assert_array_equal(found.depth, expected.depth)
        np.testing.assert_array_equal(found.coarse, expected.coarse)
        assert found.rgb_known.all()
        shape = images.depth.shape
        colorless = pixels_of(whole_tiles(mask, grid_of(shape, AVIF.side_px)), shape, AVIF.side_px)
        stream = np.frombuffer(EXACT.encode(images, sent.packet_bytes), np.uint8)
        whole = EXACT.decode(stream, np.ones(stream.size, np.bool_), shape, sent.packet_bytes)
        np.testing.assert_array_equal(found.rgb, np.where(colorless[..., None], expected.rgb, whole.rgb))


def test_a_tile_is_shown_by_tiles_that_are_sent(rig):
    """Each camera's tiles are still left out if what the others leave out is unknown."""
    views = [
        base_view(images_of(frame), units_per_m(frame.depth), frame.intrinsics, T)
        for frame, T in zip(rig.frames, rig.truth.T_world_camera, strict=True)
    ]
    masks = shared_views(views).leave_out
    assert sum(mask.sum() for mask in masks) > 100
    for camera, mask in enumerate(masks):
        known = [
            view if other == camera else replace(view, z_m=np.where(_blocks(out), np.nan, view.z_m))
            for other, (view, out) in enumerate(zip(views, masks, strict=True))
        ]
        order = [*(other for other in range(len(views)) if other != camera), camera]
        assert not (mask & ~shared_views(known, order).leave_out[camera]).any()


def _blocks(tiles):
    return tiles.repeat(4, axis=0).repeat(4, axis=1)


def test_requests_come_after_all_base_layers_and_the_computing_and_take_the_air(sent):
    left_out, trace = sent.left_out, sent.trace
    asked = requests(trace, EventKind.ENQUEUE)
    first = trace.config.nodes.first_bytes_by_node
    came = sent.arrivals
    ends_ns = [
        came.t_ns[(came.node == node) & (came.first_byte < size)].max() for node, size in enumerate(first)
    ]
    assert asked.t_ns.min() == max(ends_ns) + to_ns(1.0)
    assert left_out.requested_s == asked.t_ns.min() / 1e9
    assert set(requests(trace, EventKind.AIR).node) == {3}
    assert left_out.request_bytes == (38, 38, 38)
    assert left_out.answered == left_out.placed == left_out.base_arrived == (True, True, True)
    assert (left_out.shown_by.sum(axis=1) >= left_out.counts).all()
    assert not left_out.shown_by.diagonal().any()


def test_fewer_bytes_take_less_time_where_the_radio_is_slow_and_more_where_it_is_fast(rig, sent):
    slow = send(delivery(rig, leave_out_seen=False), rig)
    assert sent.times_ns[-1] < 0.92 * slow.times_ns[-1]
    assert sent.spent.platform_j[-1] < 0.92 * slow.spent.platform_j[-1]
    fast, plain = (send(delivery(rig, preset="office", leave_out_seen=seen), rig) for seen in (True, False))
    assert fast.spent.sent_bytes[-1] < plain.spent.sent_bytes[-1]
    assert fast.times_ns[-1] > plain.times_ns[-1]


def test_without_it_every_node_sends_all_its_bytes_without_a_request(rig):
    plain = send(delivery(rig, leave_out_seen=False), rig)
    assert plain.left_out is None
    assert not len(requests(plain.trace, EventKind.ENQUEUE))
    for frame, stream in zip(rig.frames, plain.streams, strict=True):
        assert stream.tobytes() == EXACT.encode(images_of(frame), plain.packet_bytes)


def test_nothing_is_left_out_where_no_view_is_shared(rig):
    away = np.diag([-1.0, -1.0, 1.0, 1.0])
    away[:3, 3] = (40.0, 0.0, 0.0)
    first, second = rig.frames[:2]
    apart = Rig("apart", (first, replace(second, T_world_camera=away @ second.T_world_camera)))
    sending = send(delivery(apart, preset="office"), apart)
    assert sending.left_out.counts == (0, 0)
    assert sending.left_out.left_out_bytes == (0, 0)
    assert sending.left_out.requested_s is not None
    for frame, stream in zip(apart.frames, sending.streams, strict=True):
        assert stream.tobytes() == EXACT.encode(images_of(frame), sending.packet_bytes)


def test_a_base_layer_that_is_lost_counts_for_nobody_and_its_node_sends_all(rig):
    lossy = ("nodes.retransmit=false", "mac.kind=ideal", "mac.link_bps=1e6", "loss.share=0.03", "run.seed=3")
    sending = send(delivery(rig, *lossy), rig)
    left_out = sending.left_out
    lost = [node for node, had in enumerate(left_out.base_arrived) if not had]
    assert lost
    assert len(lost) < 3
    for node in lost:
        assert left_out.counts[node] == 0
        assert left_out.left_out_bytes[node] == 0
        assert not left_out.shown_by[:, node].any()


def test_a_node_that_is_down_shows_nothing(rig):
    sending = send(delivery(rig, down=("node_00",)), rig)
    left_out = sending.left_out
    assert left_out.base_arrived == (False, True, True)
    assert left_out.answered == (False, True, True)
    assert left_out.counts[0] == left_out.left_out_bytes[0] == 0
    assert not left_out.shown_by[:, 0].any()
    assert sum(left_out.counts) > 0


def test_the_mesh_is_no_worse(rig):
    spec = replace(delivery(rig, preset="office"), moments=1)
    few, whole = (send(replace(spec, leave_out_seen=seen), rig) for seen in (True, False))
    scores = [drain(Rebuilder(one).moment(0)).truth["f_score_5cm"] for one in (few, whole)]
    assert scores[0] > scores[1] - 0.005


@pytest.mark.parametrize(
    ("settings", "fields", "names"),
    [
        ((), {"coding": "layered"}, "coding exact only, not of layered"),
        (("mac.kind=lte-m",), {}, "Over lte-m the sink sends nodes no packets"),
        (("mac.kind=lora",), {}, "Over lora with mac.ack=true"),
        (("mac.kind=ideal", "nodes.payload_bytes=9000"), {}, "at most 8192"),
    ],
)
def test_what_cannot_be_left_out_is_one_sentence(settings, fields, names):
    small = small_rig()
    with pytest.raises(InputError) as error:
        delivery(small, *settings, **fields)
    assert names in str(error.value)


@pytest.mark.parametrize(("nodes", "down"), [(1, ()), (2, ("node_01",))])
def test_one_camera_has_nobody_whose_tiles_could_show_its_own(nodes, down):
    small = small_rig(nodes)
    with pytest.raises(InputError, match="Only one camera"):
        send(delivery(small, down=down), small)


def test_wrong_poses_that_the_base_layers_do_not_repair_leave_out_less(rig, sent):
    turn = np.eye(4)
    turn[:3, :3] = rotation_exp(np.array([0.0, 0.0, np.deg2rad(60.0)]))
    first, second, third = rig.frames
    wrong = replace(third, T_world_camera=third.T_world_camera @ turn)
    bad = replace(rig, frames=(first, second, wrong))
    left_out = send(delivery(bad), bad).left_out
    assert left_out.counts[2] < 0.5 * sent.left_out.counts[2]
