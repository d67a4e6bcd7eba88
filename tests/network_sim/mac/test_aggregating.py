"""Several packets in a frame: scenes whose answer is known to the nanosecond, and properties of random
ones."""

from __future__ import annotations

import math
from collections import Counter
from typing import Any

import pytest

from network_sim.config import LossConfig, MacConfig, NetworkConfig, NodesConfig, RadioConfig
from network_sim.mac import physical_layer
from network_sim.mac.bianchi import bianchi, timing_of
from network_sim.mac.saturation import saturation
from network_sim.trace.log import Events
from network_sim.types import Cause, EventKind
from tests.network_sim.mac.star_scene import StarScene

US = 1000
N, AX, AH = "ieee80211n", "ieee80211ax", "ieee80211ah"
SIZE = 1500
SUBFRAME = 4 + 1540
"""1538 bytes with headers, padded to a multiple of four, and a delimiter."""


def config(kind: str = N, share: float = 0.0, sense_m: float = 220.0, **mac: Any) -> NetworkConfig:
    return NetworkConfig(
        radio=RadioConfig(sense_range_m=sense_m),
        mac=MacConfig(kind=kind, **mac),  # type: ignore[arg-type]
        loss=LossConfig(share),
    )


def scene(count: int = 1, at_m: tuple[float, ...] = (5.0,), seed: int = 0, **options: Any) -> StarScene:
    """Nodes around a sink; the first one sends ``count`` packets from the start on."""
    it = StarScene(config(**options), at_m, seed)
    it.send_all(0, 0, range(count), SIZE)
    return it


def frames(events: Events, node: int = 0) -> list[tuple[int, int, list[int]]]:
    """Start, end and packets of each data frame of a node."""
    found: list[tuple[int, int, list[int]]] = []
    air = events.of(EventKind.AIR)
    columns = (air.node, air.t_ns, air.duration_ns, air.packet)
    for sender, t_ns, duration_ns, packet in zip(*(column.tolist() for column in columns), strict=True):
        if sender != node:
            continue
        if found and found[-1][1] == t_ns:
            start_ns, _, packets = found.pop()
            found.append((start_ns, t_ns + duration_ns, [*packets, packet]))
        else:
            found.append((t_ns, t_ns + duration_ns, [packet]))
    return found


def test_packets_that_are_handed_over_together_go_out_in_one_frame() -> None:
    it = scene(10)
    events = it.run()
    duration_ns = (36 + 4 * math.ceil((8 * (9 * SUBFRAME + 1542) + 22) / 260) + 6) * US
    assert frames(events) == [(0, duration_ns, list(range(10)))]
    answers = events.of(EventKind.ACK)
    assert answers.t_ns.tolist() == [duration_ns + 10 * US]
    assert answers.duration_ns.tolist() == [38 * US]  # block acknowledgement of 32 bytes at 24 Mb/s
    assert answers.size_bytes.tolist() == [32]
    assert events.of(EventKind.AIR).size_bytes.tolist() == [SUBFRAME] * 9 + [1542]
    over_ns = duration_ns + 48 * US
    ends = [(t_ns, outcome[:3]) for t_ns, _, outcome in it.outcomes]
    assert ends == [(over_ns, (True, Cause.NONE, 1))] * 10
    assert it.received == [(duration_ns, packet, 1) for packet in range(10)]


def test_a_single_packet_is_a_plain_frame_with_a_plain_acknowledgement() -> None:
    events = scene(1).run()
    assert frames(events) == [(0, physical_layer(MacConfig(N)).data.air_ns(SIZE + 38), [0])]
    assert events.of(EventKind.ACK).size_bytes.tolist() == [14]
    events = scene(1, kind=AX, mcs=9).run()
    assert events.of(EventKind.AIR).size_bytes.tolist() == [4 + SIZE + 38]


def test_without_aggregation_every_packet_has_its_own_frame() -> None:
    events = scene(5, ampdu_packets=1).run()
    assert [packets for _, _, packets in frames(events)] == [[k] for k in range(5)]
    assert set(events.of(EventKind.ACK).size_bytes.tolist()) == {14}


@pytest.mark.parametrize(
    ("options", "most"),
    [
        # as many as fit: 4 + 1540 bytes each, and 4 + 1538 the last
        ({"kind": N}, (65_535 - 1542) // SUBFRAME + 1),
        ({"kind": N, "mcs": 0}, (((10_000 - 36 - 6) // 4 * 26 - 22) // 8 - 1542) // SUBFRAME + 1),  # 10 ms
        ({"kind": N, "ampdu_packets": 7}, 7),
        ({"kind": N, "ampdu_bytes": 10_000}, (10_000 - 1542) // SUBFRAME + 1),
        ({"kind": N, "ampdu_bytes": 100}, 1),
        ({"kind": AX, "mcs": 11}, 62),  # 5.484 ms: (5484 - 49.2) / 13.6 = 399 symbols of 1950 bits
        ({"kind": AX, "mcs": 9, "ampdu_packets": 200}, 50),
        ({"kind": AH}, (16_605 - 1542) // SUBFRAME + 1),  # 511 symbols of 260 bits
        ({"kind": AH, "bandwidth_hz": 1e6, "mcs": 3}, (3_064 - 1542) // SUBFRAME + 1),
    ],
)
def test_a_frame_holds_as_much_as_the_standard_allows(options: dict[str, Any], most: int) -> None:
    events = scene(300, **options).run()
    sizes = [len(packets) for _, _, packets in frames(events)]
    assert max(sizes) == most
    assert sizes.count(most) >= 2
    assert sum(sizes) == 300


@pytest.mark.parametrize(
    "options", [{"kind": N}, {"kind": AX, "mcs": 9}, {"kind": AH}, {"kind": N, "rts": True}]
)
@pytest.mark.parametrize("senders", [1, 3])
def test_only_what_got_lost_is_sent_again_and_nothing_arrives_twice(options: Any, senders: int) -> None:
    it = StarScene(config(share=0.3, **options), [5.0] * senders)
    for node in range(senders):
        it.send_all(node, 0, range(1000 * node, 1000 * node + 200), SIZE)
    events = it.run()
    sent = Counter(events.of(EventKind.AIR).packet.tolist())
    losses = events.of(EventKind.LOSS)
    lost = Counter(losses.packet.tolist())
    outcomes = {packet: outcome for _, packet, outcome in it.outcomes}
    assert len(it.outcomes) == len(outcomes) == 200 * senders
    arrived = [packet for _, packet, _ in it.received]
    assert len(arrived) == len(set(arrived))
    for packet, outcome in outcomes.items():
        assert outcome.attempts == lost[packet] + outcome.ok
        assert outcome.ok or outcome.attempts == 7
        assert (packet in arrived) == (outcome.ok or outcome.cause is Cause.ACK_LOST)
        if not options.get("rts"):
            assert sent[packet] == outcome.attempts
    share = (losses.cause == Cause.LINK).sum() / sent.total()
    assert share == pytest.approx(0.3 if senders == 1 else share, abs=0.06)


def test_a_lost_packet_holds_back_those_beyond_its_window_only() -> None:
    events = scene(400, share=0.4, ampdu_packets=16).run()
    closed: set[int] = set()
    lost = {(t_ns, packet) for t_ns, packet in zip(*_columns(events.of(EventKind.LOSS)), strict=True)}
    attempts: Counter[int] = Counter()
    waited = 0
    for _, end_ns, packets in frames(events):
        first = min(set(range(400)) - closed)
        assert packets[0] == first
        assert max(packets) < first + 16
        assert packets == sorted(packets)
        waited += len(packets) < 16
        for packet in packets:
            attempts[packet] += 1
            if (end_ns, packet) not in lost or attempts[packet] == 7:
                closed.add(packet)
    assert waited > 5


def _columns(events: Events) -> tuple[list[int], list[int]]:
    return events.t_ns.tolist(), events.packet.tolist()


def test_packets_that_come_while_a_frame_is_on_the_air_join_the_next_one() -> None:
    it = scene(3)
    it.send_all(0, 100 * US, range(3, 8), SIZE)
    assert [packets for _, _, packets in frames(it.run())] == [[0, 1, 2], [3, 4, 5, 6, 7]]


def test_a_frame_goes_to_one_receiver() -> None:
    it = StarScene(config(), [5.0, 5.0])
    for number, to in enumerate((2, 1, 2, 1)):
        it.send(0, 0, number, SIZE, to)
    assert [packets for _, _, packets in frames(it.run())] == [[0, 2], [1, 3]]
    assert sorted((packet, node) for _, packet, node in it.received) == [(0, 2), (1, 1), (2, 2), (3, 1)]


def test_frames_that_begin_together_are_lost_whole_and_then_sent_apart() -> None:
    it = StarScene(config(), [5.0, 5.0])
    for node in range(2):
        it.send_all(node, 0, range(10 * node, 10 * node + 4), SIZE)
    events = it.run()
    first_ns = frames(events)[0][1]
    losses = events.of(EventKind.LOSS)
    assert sorted(losses.packet.tolist()) == [*range(4), *range(10, 14)]
    assert set(losses.cause.tolist()) == {Cause.COLLISION}
    assert set(losses.t_ns.tolist()) == {first_ns}
    second_ns = min(frames(events, node)[1][0] for node in range(2))
    counted_ns = second_ns - first_ns - (10 + 9 + 20 + 37) * US  # SIFS, slot, start of an answer; AIFS
    assert counted_ns % (9 * US) == 0
    assert 0 <= counted_ns < 32 * 9 * US  # the window has doubled
    assert len(it.received) == 8


def test_a_hidden_station_destroys_only_the_packets_that_it_overlaps() -> None:
    it = StarScene(config(sense_m=110.0), [90.0, 90.0])
    it.send_all(0, 0, range(4), SIZE)
    it.send(1, 700 * US, 10, 100)  # a short frame, while the last packet is on the air
    events = it.run()
    (start_ns, end_ns, packets), *_ = frames(events)
    short_ns = frames(events, 1)[0][0]
    air = events.of(EventKind.AIR)
    last_ns = air.t_ns[air.packet == 3].min()
    assert (start_ns, packets) == (0, [0, 1, 2, 3])
    assert last_ns < short_ns < end_ns
    losses = events.of(EventKind.LOSS)
    first = losses.where(losses.node == 0)
    assert (first.packet[0], first.t_ns[0], first.cause[0]) == (3, end_ns, Cause.COLLISION)
    assert [packet for t_ns, packet, _ in it.received if t_ns == end_ns] == [0, 1, 2]


def test_a_destroyed_preamble_takes_all_packets_with_it() -> None:
    it = StarScene(config(sense_m=110.0), [90.0, 90.0])
    it.send(1, 0, 10, 100)
    it.send_all(0, 20 * US, range(4), SIZE)  # begins while the other's frame is on the air
    events = it.run()
    end_ns = frames(events)[0][1]
    losses = events.of(EventKind.LOSS)
    mine = losses.where((losses.node == 0) & (losses.t_ns == end_ns))
    assert mine.packet.tolist() == [0, 1, 2, 3]


def test_bit_errors_strike_single_packets() -> None:
    base = config(mcs=7)
    # 64-QAM 5/6 loses about a tenth of frames of 1000 bytes 1.7 dB above the ratio that the standard implies.
    places = StarScene(base, [99.0]).radio
    noise_dbm = 10 * math.log10(1e3 * places.mean_power_w(99.0)) - 23.7
    noisy = NetworkConfig(
        radio=RadioConfig(noise_dbm=noise_dbm), mac=base.mac, nodes=NodesConfig(payload_bytes=SIZE)
    )
    it = StarScene(noisy, [99.0])
    it.send_all(0, 0, range(400), SIZE)
    losses = it.run().of(EventKind.LOSS)
    assert set(losses.cause.tolist()) == {Cause.NOISE}
    assert 20 < len(losses) < 150
    assert len(it.received) == 400


def test_out_of_range_all_packets_are_given_up_after_seven_attempts() -> None:
    it = scene(5, at_m=(101.0,))
    events = it.run()
    assert [len(packets) for _, _, packets in frames(events)] == [5] * 7
    assert {outcome[:3] for _, _, outcome in it.outcomes} == {(False, Cause.RETRIES, 7)}
    assert set(events.of(EventKind.LOSS).cause.tolist()) == {Cause.RANGE}


@pytest.mark.parametrize(("options", "most_m"), [({"mcs": 7}, 100.0), ({"mcs": 0}, 794.0)])
def test_a_lower_mcs_reaches_farther(options: dict[str, Any], most_m: float) -> None:
    """18 dB less at MCS 0: 100 m * 10^(18 / 20) in free space."""
    for distance_m, well in ((most_m - 1, True), (most_m + 1, False)):
        free = RadioConfig(model="friis", sense_range_m=2000.0)
        it = StarScene(NetworkConfig(radio=free, mac=MacConfig(N, **options)), [distance_m])
        it.send(0, 0, 0, SIZE)
        it.run()
        assert bool(it.received) == well


def test_a_node_that_goes_down_hands_all_its_packets_back_the_last_one_first() -> None:
    it = scene(100)
    it.turn_off(0, 100 * US)
    it.run()
    back = [(packet, outcome) for _, packet, outcome in it.outcomes]
    assert len(back) == 100
    assert not any(outcome.ok for _, outcome in back)
    # Those that wait in the medium access, the last one first; then each that is handed over, at once.
    waiting = [packet for packet, outcome in back if outcome.attempts or packet < 64]
    assert waiting == sorted(waiting, reverse=True)
    assert {outcome.cause for _, outcome in back} == {Cause.NODE_DOWN}


def test_an_rts_reserves_the_channel_for_the_whole_frame() -> None:
    events = scene(10, rts=True).run()
    answers = events.of(EventKind.ACK)
    assert answers.size_bytes.tolist() == [20, 14, 32]
    # RTS of 20 bytes at 24 Mb/s: 20 + 4 ceil(182 / 96) + 6 = 34 us; CTS 34; two SIFS
    assert answers.t_ns.tolist()[:2] == [0, (34 + 10) * US]
    start_ns, end_ns, _ = frames(events)[0]
    assert start_ns == (34 + 10 + 34 + 10) * US
    assert answers.t_ns[2] == end_ns + 10 * US


PROFILES = [
    ({"kind": N, "mcs": 0}, 1.0),
    ({"kind": N, "mcs": 7}, 1.0),
    ({"kind": AX, "mcs": 9}, 1.0),
    ({"kind": AH, "mcs": 7}, 30.0),
    ({"kind": AH, "mcs": 0, "bandwidth_hz": 1e6}, 60.0),
]


@pytest.mark.parametrize("packets", [1, 4])
@pytest.mark.parametrize("stations", [1, 3, 10])
@pytest.mark.parametrize(("options", "duration_s"), PROFILES)
def test_saturated_stations_get_what_bianchi_says(
    options: dict[str, Any], duration_s: float, stations: int, packets: int
) -> None:
    mac = MacConfig(**options, ampdu_packets=packets)
    layer = physical_layer(mac)
    size = 428 if options.get("bandwidth_hz") == 1e6 else 1028
    packets = 1 if size == 428 else packets
    network = NetworkConfig(mac=mac, nodes=NodesConfig(payload_bytes=size, header_bytes=28, spacing_m=5.0))
    timing = timing_of(layer, size, 28, packets)
    if packets == 1 and size == 428:
        network = NetworkConfig(mac=MacConfig(**options, ampdu_packets=1), nodes=network.nodes)
    model = bianchi(stations, timing, window=16, stages=6, silence_us=layer.eifs_ns / 1e3)
    found = saturation(network, stations, duration_s, seed=1)
    assert found.throughput_bps == pytest.approx(model.throughput_bps, rel=0.05)
    assert found.delivery_ratio > 0.99


def test_one_station_gets_what_one_exchange_gives() -> None:
    """20 packets of 1000 bytes in a frame at 65 Mb/s: AIFS, 7.5 slots on average, the frame, SIFS, the
    answer."""
    frame_us = 36 + 4 * math.ceil((8 * (19 * (4 + 1068) + 4 + 1066) + 22) / 260) + 6
    cycle_us = 37 + 7.5 * 9 + frame_us + 10 + 38
    network = NetworkConfig(
        mac=MacConfig(N, ampdu_packets=20),
        nodes=NodesConfig(payload_bytes=1028, header_bytes=28, spacing_m=5.0),
    )
    found = saturation(network, 1, 4.0, seed=1)
    assert found.throughput_bps == pytest.approx(20 * 8000 / cycle_us * 1e6, rel=0.01)
