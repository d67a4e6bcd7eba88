"""LoRaWAN: times on the air from the data sheet, ALOHA against its closed forms, the duty cycle, replies."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from network_sim.config import MacConfig, NetworkConfig, NodesConfig, RadioConfig
from network_sim.mac.lora import ACK_BYTES, HEADER_BYTES, airtime_ns
from network_sim.presets import PRESETS
from network_sim.radio.propagation import Radio, reach_m, watts
from network_sim.settings.mac import LORA_PAYLOAD_BYTES
from network_sim.simulate import simulate
from network_sim.types import NS_PER_S, Cause, EventKind
from packetmesh.errors import InputError
from packetmesh.settings import with_settings
from tests.network_sim.mac.star_scene import StarScene

SIZE = 20
T_NS = airtime_ns(HEADER_BYTES + SIZE, 7)
ACK_NS = airtime_ns(ACK_BYTES, 7, False)


def config(ack: bool = False, **radio: float | None) -> NetworkConfig:
    """A power law of exponent 3 up to 3100 m, which reaches all nodes of the scenes."""
    return NetworkConfig(
        radio=replace(
            RadioConfig(model="log-distance", frequency_hz=868.1e6, range_m=3100.0, sense_range_m=3100.0),
            **radio,  # type: ignore[arg-type]
        ),
        mac=MacConfig(kind="lora", ack=ack),
        nodes=NodesConfig(payload_bytes=SIZE),
    )


@pytest.mark.parametrize(
    ("frame_bytes", "spreading_factor", "ms"),
    [
        (51, 12, 2465.792),
        (20, 7, 56.576),
        (23, 7, 61.696),  # 10 bytes of an application by each factor, as calculators of airtime print them
        (23, 8, 113.152),
        (23, 9, 205.824),
        (23, 10, 370.688),
        (23, 11, 823.296),
        (23, 12, 1482.752),
    ],
)
def test_time_on_the_air_is_that_of_the_data_sheet(frame_bytes, spreading_factor, ms):
    assert airtime_ns(frame_bytes, spreading_factor) == round(ms * 1e6)


def test_without_a_check_sum_a_frame_is_never_longer():
    """12 bytes with factor 7: 96 bits instead of 112 after the first block, 4 instead of 5 blocks more."""
    assert airtime_ns(12, 7, False) == round((12.25 + 8 + 5 * math.ceil(96 / 28)) * 1.024e6)
    for size in range(5, 60):
        for factor in range(7, 13):
            assert airtime_ns(size, factor, False) <= airtime_ns(size, factor)


def test_a_sender_keeps_the_duty_cycle_of_one_per_cent():
    scene = StarScene(config(), [50.0])
    scene.send_all(0, 0, range(200), SIZE)
    frames = scene.run().of(EventKind.AIR)
    assert len(frames) == 200
    assert set(frames.duration_ns.tolist()) == {T_NS}
    between_ns = np.diff(frames.t_ns)
    assert between_ns.min() >= 100 * T_NS
    assert between_ns.max() < 102 * T_NS
    assert between_ns.mean() == pytest.approx(101 * T_NS, rel=0.002)


def load(scene: StarScene, nodes: range, frames_per_airtime: float, count: int, seed: int) -> None:
    """Frames that begin at random (Poisson), each of a node that has been silent for long enough."""
    rng = np.random.default_rng(seed)
    starts_ns = np.cumsum(rng.exponential(T_NS / frames_per_airtime, count)).round().astype(int).tolist()
    for number, start_ns in enumerate(starts_ns):
        scene.send(nodes[number % len(nodes)], start_ns, 100 * nodes.start + number, SIZE)


@pytest.mark.parametrize("g", [0.1, 0.5, 1.0])
def test_without_capture_the_throughput_is_that_of_pure_aloha(g):
    """S = G exp(-2 G) (Abramson 1970); equal powers are never captured."""
    scene = StarScene(config(), [100.0] * 300)
    load(scene, range(300), g, 8000, seed=3)
    events = scene.run()
    frames = events.of(EventKind.AIR)
    offered = len(frames) * T_NS / float(frames.t_ns.max())
    assert offered == pytest.approx(g, rel=0.03)
    share = len(events.of(EventKind.DELIVER)) / len(frames)
    assert share == pytest.approx(math.exp(-2.0 * offered), rel=0.05)
    assert set(events.of(EventKind.LOSS).cause.tolist()) == {Cause.COLLISION}


def test_near_nodes_are_captured_as_in_metzners_two_groups():
    """Far nodes 60 dB weaker never disturb near ones: the near lose by their own load alone, the far by the
    sum (Metzner 1976, IEEE Transactions on Communications 24(4), here without slots)."""
    near, far, g_near, g_far = range(150), range(150, 300), 0.35, 0.3
    scene = StarScene(config(), [10.0] * 150 + [1000.0] * 150)
    load(scene, near, g_near, 7000, seed=1)
    load(scene, far, g_far, 6000, seed=2)
    events = scene.run()
    delivered, frames = events.of(EventKind.DELIVER), events.of(EventKind.AIR)
    for nodes, lost_by in ((near, g_near), (far, g_near + g_far)):
        of = [int(np.isin(part.node, nodes).sum()) for part in (delivered, frames)]
        assert of[0] / of[1] == pytest.approx(math.exp(-2.0 * lost_by), rel=0.05)


@pytest.mark.parametrize(("ratio_db", "kept"), [(5.9, []), (6.1, [1])])
@pytest.mark.parametrize("first", [0, 1])
def test_a_frame_six_decibels_above_another_survives_first_or_second(ratio_db, kept, first):
    scene = StarScene(config(), [100.0 * 10 ** (ratio_db / 30.0), 100.0])
    scene.send(0, 0 if first == 0 else T_NS // 3, 0, SIZE)
    scene.send(1, 0 if first == 1 else T_NS // 3, 1, SIZE)
    assert scene.run().of(EventKind.DELIVER).packet.tolist() == kept


@pytest.mark.parametrize("factor", range(7, 13))
def test_the_receive_threshold_of_the_preset_is_the_sensitivity_of_the_data_sheet(factor):
    dbm = {7: -123.0, 8: -126.0, 9: -129.0, 10: -132.0, 11: -133.0, 12: -136.0}[factor]
    payload = f"nodes.payload_bytes={LORA_PAYLOAD_BYTES[factor]}"
    preset = with_settings(PRESETS["lora"], [f"mac.spreading_factor={factor}", payload])
    radio = Radio(preset.radio, preset.mac, np.random.default_rng(0))
    assert 10 * math.log10(radio.rx_threshold_w / watts(0.0)) == pytest.approx(dbm, abs=0.05)
    assert reach_m(preset) == pytest.approx(3100.0 * 10 ** ((-123.0 - dbm) / 30.0), rel=1e-6)


@pytest.mark.parametrize(("above_db", "arrives"), [(-7.6, False), (-7.4, True)])
def test_with_noise_a_frame_needs_the_ratio_of_its_spreading_factor(above_db, arrives):
    quiet = config()
    radio = Radio(quiet.radio, quiet.mac, np.random.default_rng(0))
    received_dbm = 10 * math.log10(radio.mean_power_w(100.0) / watts(0.0))
    scene = StarScene(config(noise_dbm=received_dbm - above_db), [100.0])
    scene.send(0, 0, 0, SIZE)
    events = scene.run()
    assert (len(events.of(EventKind.DELIVER)) == 1) is arrives
    assert events.of(EventKind.LOSS).cause.tolist() == ([] if arrives else [Cause.NOISE])


def test_an_acknowledgement_comes_a_second_after_the_frame():
    scene = StarScene(config(ack=True), [50.0])
    scene.send(0, 0, 7, SIZE)
    events = scene.run()
    assert events.of(EventKind.ACK).t_ns.tolist() == [T_NS + NS_PER_S]
    assert events.of(EventKind.ACK).duration_ns.tolist() == [ACK_NS]
    ((at_ns, number, outcome),) = scene.outcomes
    assert (at_ns, number) == (T_NS + NS_PER_S + ACK_NS, 7)
    assert (outcome.ok, outcome.cause, outcome.attempts) == (True, Cause.NONE, 1)


def test_the_gateways_duty_cycle_leaves_the_next_frame_unanswered():
    """The second frame ends half a second later; the gateway may not send for 100 times its answer."""
    scene = StarScene(config(ack=True), [50.0, 60.0])
    scene.send(0, 0, 0, SIZE)
    scene.send(1, T_NS + NS_PER_S // 2, 1, SIZE)
    events = scene.run()
    answers = events.of(EventKind.ACK)
    assert np.diff(answers.t_ns).min() >= 100 * ACK_NS
    assert events.of(EventKind.LOSS).cause.tolist() == [Cause.ACK_LOST]
    second = events.of(EventKind.AIR)
    assert second.packet.tolist() == [0, 1, 1]
    assert second.t_ns[2] - second.t_ns[1] >= 100 * T_NS
    assert [(packet, node) for _, packet, node in scene.received] == [(0, 2), (1, 2)]
    assert [outcome.attempts for _, _, outcome in scene.outcomes] == [1, 2]


def test_an_unanswered_frame_is_sent_eight_times():
    alone = with_settings(config(ack=True), ["loss.share=1"])
    scene = StarScene(alone, [50.0])
    scene.send(0, 0, 0, SIZE)
    assert len(scene.run().of(EventKind.AIR)) == 8
    assert scene.outcomes[0][2][:3] == (False, Cause.RETRIES, 8)


def test_a_downlink_waits_for_the_window_after_the_nodes_own_frame():
    scene = StarScene(config(), [50.0, 60.0])
    scene.send(scene.sink, 0, 9, SIZE, to=0)
    scene.send(1, NS_PER_S, 1, SIZE)
    scene.send(0, 5 * NS_PER_S, 0, SIZE)
    frames = scene.run().of(EventKind.AIR)
    assert frames.packet.tolist() == [1, 0, 9]
    assert frames.t_ns[2] == 5 * NS_PER_S + T_NS + NS_PER_S
    assert frames.duration_ns[2] == airtime_ns(HEADER_BYTES + SIZE, 7, False)
    assert (scene.received[-1][1], scene.received[-1][2]) == (9, 0)


def test_a_newer_downlink_replaces_the_older_and_one_without_a_window_expires():
    scene = StarScene(config(), [50.0])
    scene.send(scene.sink, 0, 1, SIZE, to=0)
    scene.send(scene.sink, NS_PER_S, 2, SIZE, to=0)
    assert len(scene.run().of(EventKind.AIR)) == 0
    assert [(number, outcome.ok, outcome.cause) for _, number, outcome in scene.outcomes] == [
        (1, False, Cause.BUFFER),
        (2, False, Cause.DEADLINE),
    ]
    assert scene.outcomes[1][0] == NS_PER_S + 600 * T_NS


def test_while_the_gateway_sends_it_receives_nothing():
    scene = StarScene(config(ack=True), [50.0, 51.0])
    scene.send(0, 0, 0, SIZE)
    scene.send(1, T_NS + NS_PER_S - T_NS // 2, 1, SIZE)
    losses = scene.run().of(EventKind.LOSS)
    assert (losses.packet[0], losses.cause[0]) == (1, Cause.COLLISION)


def test_lost_fragments_are_requested_in_receive_windows_until_the_image_is_complete():
    changes = ["nodes.image_bytes=9000", "nodes.depth_bytes=0", "loss.share=0.2", "uplink.rate_bps=none"]
    trace = simulate(with_settings(PRESETS["lora"], changes))
    events = trace.events
    assert len(events.of(EventKind.ARRIVE)) == 3
    assert trace.horizon_ns < 3 * 3600 * NS_PER_S
    frames = events.of(EventKind.AIR)
    for node in range(4):
        own = frames.where(frames.node == node)
        assert (np.diff(own.t_ns) >= 100 * own.duration_ns[:-1]).all()
        assert len(own) > 0
    ends_ns = frames.t_ns + frames.duration_ns
    downlinks = frames.where(frames.node == 3)
    for start_ns, peer in zip(downlinks.t_ns, downlinks.peer, strict=True):
        assert start_ns - NS_PER_S in ends_ns[frames.node == peer]


def test_an_image_of_the_preset_takes_hours():
    trace = simulate(with_settings(PRESETS["lora"], ["run.keep=images"]))
    arrived_h = trace.events.of(EventKind.ARRIVE).t_ns / 3600e9
    fragments = math.ceil(252_000 / 214)
    airtime_h = fragments * 100 * airtime_ns(HEADER_BYTES + 222, 7) / 3600e9
    assert len(arrived_h) == 3
    assert 1.0 < arrived_h.max() / airtime_h < 1.1
    assert airtime_h == pytest.approx(12.1, abs=0.2)


@pytest.mark.parametrize(("factor", "most"), [(7, 222), (9, 115), (12, 51)])
def test_a_packet_is_as_large_as_the_spreading_factor_allows(factor, most):
    settings = [f"mac.spreading_factor={factor}", f"nodes.payload_bytes={most}"]
    assert with_settings(PRESETS["lora"], settings).nodes.payload_bytes == most
    with pytest.raises(InputError, match=f"lora carries {most} with mac.spreading_factor={factor}"):
        with_settings(PRESETS["lora"], [settings[0], f"nodes.payload_bytes={most + 1}"])
