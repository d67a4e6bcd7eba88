"""A walking camera as one node, which sends its keyframes from the times at which it took them."""

from dataclasses import replace

import numpy as np
import pytest

from network_sim.metrics.arrivals import energy_by_node_j
from network_sim.presets import PRESETS
from network_sim.types import Cause, EventKind
from packetmesh.errors import InputError
from packetmesh.progress import drain
from packetmesh.settings import with_settings
from pipeline.deliver import iterate_delivery
from pipeline.delivery.sending import arrived_bytes, send
from pipeline.delivery.walked import image_times_s, walk_network
from pipeline.folders.delivery import delivery_metrics, walk_sentences
from tests.pipeline.delivery.small import READY_S, delivery_spec, small_rig, walked


@pytest.fixture(scope="module")
def rig():
    return walked(small_rig(nodes=3))


@pytest.fixture(scope="module")
def sending(rig):
    return send(delivery_spec(rig), rig)


@pytest.fixture(scope="module")
def delivery(rig):
    return drain(iterate_delivery(delivery_spec(rig, moments=4)))


def test_images_are_ready_at_their_frames_times_since_the_first_frame(rig, sending):
    """The first keyframe stands where the frame before it stands."""
    np.testing.assert_allclose(image_times_s(rig), READY_S)
    assert sending.ready_s == READY_S
    taken = sending.trace.events.of(EventKind.CAPTURE)
    np.testing.assert_allclose(taken.t_ns / 1e9, READY_S)
    assert taken.size_bytes.tolist() == [len(stream) for stream in sending.streams]


def test_one_node_sends_all_images_in_order_and_does_not_collide_with_itself(sending):
    assert sending.trace.names[:2] == ("node 1", "sink")
    came = sending.arrivals
    assert (np.diff(came.node) >= 0).all()
    assert not (sending.trace.events.of(EventKind.LOSS).cause == Cause.COLLISION).any()
    for image, ready_s in enumerate(READY_S):
        assert came.t_ns[came.node == image].min() > 1e9 * ready_s
    end_ns = int(came.t_ns.max())
    assert all(there.all() for there in arrived_bytes(sending, end_ns))
    before, _, after = arrived_bytes(sending, round(3.9e9))
    assert before.all()
    assert not after.any()


def test_the_energy_is_that_of_one_node_from_the_first_frame_on(sending):
    """Three nodes of a rig would need three times as much."""
    last_s = float(sending.times_ns[-1]) / 1e9
    energy = sending.trace.config.energy
    platform_j = sending.spent.platform_j[-1]
    assert platform_j == pytest.approx(energy.platform_w * last_s)
    assert last_s > READY_S[-1]
    used_j = energy_by_node_j(sending.trace, sending.times_ns)[-1]
    assert used_j[0] == pytest.approx(platform_j + sending.spent.radio_j[-1])


def test_the_mesh_grows_with_the_images_that_have_arrived(delivery):
    placed = [len(moment.T_world_camera) for moment in delivery.moments]
    assert placed == sorted(placed)
    assert (placed[0], placed[-1]) == (1, 3)
    early = [moment for moment in delivery.moments if moment.t_s < READY_S[-1]]
    assert any(moment.surface is not None for moment in early)
    assert max(len(moment.T_world_camera) for moment in early) == 2
    missed = [moment.surface.quality.no_hit_ray_share for moment in (early[-1], delivery.moments[-1])]
    assert missed[1] < missed[0]
    assert delivery.last is delivery.lossless


def test_the_record_has_one_node_with_its_images_in_order(delivery):
    metrics = delivery_metrics(delivery)
    assert metrics["walk"]["node"] == "camera"
    assert [image["ready_s"] for image in metrics["walk"]["images"]] == list(READY_S)
    assert sum(image["bytes"] for image in metrics["walk"]["images"]) == metrics["bytes"]
    (node,) = metrics["moments"][-1]["nodes"]
    assert [image["ready_s"] for image in node["images"]] == list(READY_S)
    assert node["delivered_bytes"] == sum(image["delivered_bytes"] for image in node["images"])
    (sentence,) = walk_sentences(delivery.sending)
    assert "one walking camera with one radio sends 3 of its 3 keyframes" in sentence
    assert "0.25 to 4 s" in sentence
    assert "8 m from the sink" in sentence


def test_the_node_stands_in_the_middle_and_the_run_goes_on_after_the_last_image(rig):
    network = walk_network(rig, (10, 20, 30), PRESETS["office"])
    places_m = np.reshape(network.nodes.places_m, (2, 2))
    middle_m = np.mean([frame.T_world_camera[:2, 3] for frame in rig.frames], axis=0)
    np.testing.assert_allclose(places_m[0], middle_m)
    assert np.linalg.norm(places_m[1] - middle_m) == pytest.approx(PRESETS["office"].nodes.spacing_m)
    assert network.run.horizon_s == PRESETS["office"].run.horizon_s + READY_S[-1]
    assert walk_network(rig, (10, 20, 30), network) == network
    given = with_settings(PRESETS["office"], ["nodes.count=1", "nodes.places_m=1,2,3,4"])
    assert walk_network(rig, (10, 20, 30), given).nodes.places_m == (1.0, 2.0, 3.0, 4.0)


@pytest.mark.parametrize("preset", ["thesis-link", "ble", "lte-m", "wifi-ax"])
def test_any_radio_carries_a_walk(rig, preset):
    """The first image alone may fill a slow radio for longer than the walk takes."""
    sending = send(delivery_spec(rig, "nodes.deadline_s=none", preset=preset), rig)
    assert sending.trace.counters.images.arrived == 3
    assert all(there.all() for there in arrived_bytes(sending, sending.trace.horizon_ns))


def test_what_needs_several_cameras_or_requests_is_refused(rig):
    spec = replace(delivery_spec(rig), coding="exact")
    with pytest.raises(InputError, match="one walking camera, so no other camera"):
        send(replace(spec, leave_out_seen=True), rig)
    with pytest.raises(InputError, match="try the order own"):
        send(replace(spec, order="worth"), rig)
    with pytest.raises(InputError, match="no node 'node_00' that could be down; try one of camera"):
        send(replace(spec, down=("node_00",)), rig)
    with pytest.raises(InputError, match="All nodes are down"):
        send(replace(spec, down=("camera",)), rig)
    places = ["nodes.count=2", "nodes.places_m=1,2,3,4,5,6"]
    with pytest.raises(InputError, match="places 2 nodes and the sink, but the camera of a recording is one"):
        walk_network(rig, (10, 20, 30), with_settings(PRESETS["office"], places))


def test_images_out_of_order_or_of_a_rig_have_no_times(rig):
    with pytest.raises(InputError, match="in their order"):
        image_times_s(replace(rig, frames=rig.frames[::-1]))
    with pytest.raises(InputError, match="stand still"):
        image_times_s(replace(rig, walk=None))
