"""A rig's images through a network: what the sink rebuilds is what its bytes say, no more and no less."""

from dataclasses import replace

import numpy as np
import pytest

from packetmesh.errors import InputError
from packetmesh.progress import drain
from packetmesh.settings import with_settings
from pipeline.deliver import iterate_delivery
from pipeline.delivery import CODINGS, moments
from pipeline.delivery.coding import Received
from pipeline.delivery.moments import Rebuilder
from pipeline.delivery.sending import arrived_bytes, moment_times_ns, received_at, send
from pipeline.folders.delivery import delivery_metrics, summary
from pipeline.reconstruct import iterate_reconstruction
from pipeline.sources import Recorded
from pipeline.spec import Spec
from pipeline.types import PointCloud, Walk
from tests.pipeline.delivery.small import CONFIG, delivery_spec, small_rig
from tests.pipeline.recording.standing import wall, write_tum

LOSSY = (
    "mac.kind=ideal",
    "mac.link_bps=1e6",
    "nodes.retransmit=false",
    "loss.share=0.2",
    "loss.burst_packets=8",
)
"""Links of their own, on which every fifth packet is lost."""


@pytest.fixture(scope="module")
def rig():
    return small_rig()


@pytest.fixture(scope="module")
def whole(rig):
    """Everything arrives in the end."""
    return deliver(delivery_spec(rig))


def deliver(spec):
    return drain(iterate_delivery(spec))


def _only_moments(spec, processes):
    """The moments without what comes after them."""
    steps, moments = iterate_delivery(spec, processes), []
    for _ in range(spec.moments):
        moments.append(next(steps))
        yield moments[-1]
    steps.close()
    return moments


def same_surface(one, other):
    if one is None or other is None:
        return one is other
    return np.array_equal(one.vertices_m, other.vertices_m) and np.array_equal(one.triangles, other.triangles)


def test_a_recording_is_opened_once_with_the_frames_of_the_settings(tmp_path):
    source = Recorded(str(write_tum(tmp_path / "still", wall(6))))
    spec = delivery_spec(None, moments=1)
    config = with_settings(CONFIG, ["recording.frames=3"])
    result = deliver(replace(spec, spec=Spec(source, config=config)))
    assert result.sending.rig.frames[0].averaging.frames == 3
    assert result.lossless.rig is result.sending.rig


def test_of_a_walk_the_keyframes_are_sent_and_rebuilt_without_the_map(rig):
    """Its map, of all frames, would show what was never sent."""
    nothing = PointCloud(np.zeros((0, 3))), 0.01, np.zeros(0, int)
    poses = tuple(frame.T_world_camera for frame in rig.frames)
    walk = Walk(np.arange(2.0), poses, (0, 1), (), *nothing, poses, ("a note",))
    keyframes = replace(rig, truth=None, walk=walk)
    result = deliver(delivery_spec(keyframes, moments=1))
    assert result.last is result.lossless
    assert result.lossless.rig.walk is None
    assert result.sending.rig.notes == ("a note",)
    assert same_surface(result.moments[-1].surface, result.last.after)
    assert len(result.last.after.triangles) > 1000


def test_in_the_end_there_is_what_a_reconstruction_of_the_images_gives(rig, whole):
    alone = drain(iterate_reconstruction(delivery_spec(rig).spec))
    last = whole.moments[-1]
    assert last.delivered_bytes == sum(node.total_bytes for node in last.nodes)
    assert same_surface(last.surface, alone.after)
    assert last.surface.quality == alone.after.quality
    assert last.truth == alone.truth_after
    assert whole.last is whole.lossless


def test_what_has_arrived_and_what_was_spent_only_grows(whole):
    for name in ("t_s", "sent_bytes", "delivered_bytes", "packets_lost", "radio_j", "energy_j"):
        values = [getattr(moment, name) for moment in whole.moments]
        assert values == sorted(values), name
    assert all(moment.energy_j > moment.radio_j > 0.0 for moment in whole.moments)
    assert all(moment.sent_bytes > moment.delivered_bytes for moment in whole.moments)


def test_moments_come_after_equal_shares_of_the_bytes(whole):
    delivered = np.array([moment.delivered_bytes for moment in whole.moments])
    wanted = delivered[-1] * np.arange(1, 5) / 4
    packet = 1464
    assert len(delivered) == 4
    assert (delivered >= wanted - 1).all()
    assert (delivered <= wanted + packet).all()


def test_depth_first_rebuilds_before_any_colour_is_there(whole):
    first = whole.moments[1]
    assert all(node.color_share < 0.5 for node in first.nodes)
    assert first.surface is not None
    assert whole.moments[-1].surface.quality.no_hit_ray_share < first.surface.quality.no_hit_ray_share


def test_a_moment_says_exactly_the_images_where_bytes_have_arrived(rig):
    sending = send(delivery_spec(rig, *LOSSY), rig)
    t_ns = int(sending.times_ns[1])
    for frame, there, received in zip(
        rig.frames, arrived_bytes(sending, t_ns), received_at(sending, t_ns), strict=True
    ):
        assert 0.0 < there.mean() < 1.0
        known = received.rgb_known
        assert np.array_equal(received.rgb[known], frame.rgb[known])
        measured = received.depth > 0
        assert np.allclose(received.depth[measured] / 1000.0, frame.depth.z_m[measured], atol=1e-6)


def test_a_moment_does_not_depend_on_those_before_it(rig):
    sending = send(delivery_spec(rig, *LOSSY, moments=2), rig)
    in_turn = Rebuilder(sending)
    for index in range(2):
        one, alone = drain(in_turn.moment(index)), drain(Rebuilder(sending).moment(index))
        assert same_surface(one.surface, alone.surface)
        assert one.truth == alone.truth


def test_poses_change_with_the_colours_that_they_depend_on(rig):
    """All depth is there at the first moment, most of the colours are not."""
    spec = delivery_spec(rig, moments=2)
    few = ("node_registration.max_iterations=3", "node_registration.max_points=500")
    config = with_settings(CONFIG, ["node_registration.method=hicp", *few])
    sending = send(replace(spec, spec=replace(spec.spec, config=config)), rig)
    in_turn = Rebuilder(sending)
    first, last = (drain(in_turn.moment(index)) for index in range(2))
    assert all(node.depth_share == 1.0 and node.color_share < 0.5 for node in first.nodes)
    alone = drain(Rebuilder(sending).moment(1))
    assert last.T_world_camera.keys() == alone.T_world_camera.keys()
    for name, T in alone.T_world_camera.items():
        assert np.array_equal(last.T_world_camera[name], T)


def test_two_processes_give_the_same_moments(rig, whole):
    there = drain(_only_moments(delivery_spec(rig), processes=2))
    for one, other in zip(whole.moments, there, strict=True):
        assert same_surface(one.surface, other.surface)
        assert (one.t_s, one.nodes, one.truth) == (other.t_s, other.nodes, other.truth)


def test_a_node_that_is_not_heard_yet_is_absent_but_its_rays_count(rig):
    """Of the second node nothing has arrived."""
    sending = send(delivery_spec(rig, coding="jpeg", moments=1), rig)
    came = sending.arrivals
    kept = came.node == 0
    columns = {
        name: getattr(came, name)[kept] for name in ("t_ns", "image", "node", "first_byte", "byte_count")
    }
    moment = drain(Rebuilder(replace(sending, arrivals=replace(came, **columns))).moment(0))
    assert set(moment.T_world_camera) == {rig.frames[0].name}
    alone = deliver(delivery_spec(small_rig(nodes=1), coding="jpeg", moments=1)).moments[-1]
    assert moment.surface.quality.no_hit_ray_share > alone.surface.quality.no_hit_ray_share + 0.05


@pytest.mark.parametrize("coding", CODINGS)
def test_no_coding_claims_more_than_has_arrived(rig, coding):
    sending = send(delivery_spec(rig, *LOSSY, coding=coding, moments=2), rig)
    received = received_at(sending, int(sending.times_ns[-1]))
    for frame, one in zip(rig.frames, received, strict=True):
        measured = one.depth > 0
        assert np.allclose(one.depth[measured] / 1000.0, frame.depth.z_m[measured], atol=1e-6)
    lost = 1.0 - np.mean([there.mean() for there in arrived_bytes(sending, int(sending.times_ns[-1]))])
    assert 0.02 < lost < 0.6


def test_pixels_that_have_not_arrived_count_as_without_a_surface(rig):
    """Of both nodes a quarter of the depth has arrived: the others' rays may meet nothing."""
    sending = send(delivery_spec(rig, moments=1), rig)
    came = sending.arrivals
    kept = came.first_byte < len(sending.streams[0]) // 10
    columns = {
        name: getattr(came, name)[kept] for name in ("t_ns", "image", "node", "first_byte", "byte_count")
    }
    moment = drain(Rebuilder(replace(sending, arrivals=replace(came, **columns))).moment(0))
    quality = moment.surface.quality
    assert len(moment.T_world_camera) == 2
    rays = sum(frame.depth.z_m.size for frame in rig.frames)
    measured = sum(int(frame.depth.valid.sum()) for frame in rig.frames)
    assert 0.0 < quality.within_2pct_share * measured <= (1.0 - quality.no_hit_ray_share) * rays


def test_layers_keep_the_scene_under_bursts(rig, whole):
    last = deliver(delivery_spec(rig, *LOSSY, coding="layered", moments=1)).moments[-1]
    assert last.delivered_bytes < sum(node.total_bytes for node in last.nodes)
    assert last.truth["f_score_5cm"] > 0.9 * whole.lossless.truth_after["f_score_5cm"]


def test_nothing_ever_arrives(rig):
    result = deliver(delivery_spec(rig, "nodes.retransmit=false", "loss.share=1"))
    (moment,) = result.moments
    assert (moment.delivered_bytes, moment.surface, moment.truth, result.last) == (0, None, None, None)
    assert moment.packets_lost > 0
    assert "none arrived" in summary(result)
    assert delivery_metrics(result)["moments"][0]["surface"] is None


def test_only_colour_arrives(rig):
    """The deadline passes before any depth is sent."""
    result = deliver(delivery_spec(rig, "nodes.deadline_s=0.05", coding="raw-color-first", moments=2))
    last = result.moments[-1]
    assert all(node.color_share > 0.0 and node.depth_share == 0.0 for node in last.nodes)
    assert last.surface is None
    assert "too little for a surface" in summary(result)


def test_a_deadline_before_the_first_packet(rig):
    """Only what was on the air already comes through."""
    sending = send(delivery_spec(rig, "nodes.deadline_s=0.0001", moments=1), rig)
    last = drain(Rebuilder(sending).moment(0))
    assert last.delivered_bytes <= 2 * 1464
    assert last.surface is None


def test_one_node_alone(rig):
    alone = small_rig(nodes=1)
    result = deliver(delivery_spec(alone, coding="jpeg", moments=2))
    assert result.moments[-1].surface is not None
    assert np.hypot(*np.reshape(result.sending.trace.config.nodes.places_m, (-1, 2))[1]) > 1.0


def test_a_coding_that_does_not_exist(rig):
    with pytest.raises(InputError, match="layered"):
        deliver(delivery_spec(rig, coding="zip"))


def test_shares_of_an_image_are_those_of_what_arrived():
    frame = small_rig().frames[0]
    received = Received.nothing(frame.depth.z_m.shape)
    height, width = received.depth.shape
    received.rgb_known[: height // 2] = True
    received.coarse[:, : width // 4] = 1500
    arrival = moments._arrival(frame, np.zeros(100, np.uint8), np.arange(100) < 30, received)
    assert (arrival.total_bytes, arrival.delivered_bytes) == (100, 30)
    assert (arrival.color_share, arrival.depth_share) == (0.5, 0.0)
    assert arrival.coarse_share == pytest.approx(width // 4 / width)


def test_times_of_moments_by_hand():
    class Came:
        t_ns = np.array([10, 20, 30, 40])
        byte_count = np.array([100, 100, 100, 100])

    assert moment_times_ns(Came, None, 2).tolist() == [20, 40]
    assert moment_times_ns(Came, None, 4).tolist() == [10, 20, 30, 40]
    assert moment_times_ns(Came, None, 40).tolist() == [10, 20, 30, 40]
