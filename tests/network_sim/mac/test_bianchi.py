"""Bianchi's model against the values of SPEC 6.3, and the simulated DCF against the model."""

from __future__ import annotations

import pytest

from network_sim.config import MacConfig, NetworkConfig, NodesConfig
from network_sim.mac import physical_layer
from network_sim.mac.bianchi import Timing, bianchi, timing_of
from network_sim.mac.ieee80211b import EIFS_NS
from network_sim.mac.saturation import saturation
from network_sim.types import Cause

FHSS = Timing(
    8184, 400, 8184, ack_us=240, rts_us=288, cts_us=240, slot_us=50, sifs_us=28, difs_us=128, delay_us=1
)
"""Bianchi's own example at 1 Mb/s (his Table II): the share of payload is the throughput over 1 Mb/s."""
STATIONS = (1, 2, 3, 5, 10, 20, 50)
SPEC_MBPS = (5.05, 5.44, 5.51, 5.47, 5.25, 4.93, 4.42)


def dcf(rts: bool = False) -> NetworkConfig:
    return NetworkConfig(
        mac=MacConfig(kind="ieee80211b", rts=rts), nodes=NodesConfig(payload_bytes=1028, header_bytes=28)
    )


@pytest.mark.parametrize(
    ("window", "stages", "rts", "expected"),
    [
        (32, 3, False, (0.8097, 0.7532, 0.6788, 0.5529)),
        (32, 5, False, (0.8102, 0.7579, 0.6975, 0.6109)),
        (128, 3, False, (0.8250, 0.8263, 0.7981, 0.7252)),
        (32, 3, True, (0.8342, 0.8371, 0.8356, 0.8270)),
    ],
)
def test_his_own_example(window: int, stages: int, rts: bool, expected: tuple[float, ...]) -> None:
    shares = [bianchi(n, FHSS, window, stages, rts).throughput_bps / 1e6 for n in (5, 10, 20, 50)]
    assert shares == pytest.approx(expected, abs=5e-5)


def test_eleven_megabits() -> None:
    rates_mbps = [bianchi(n).throughput_bps / 1e6 for n in STATIONS]
    assert rates_mbps == pytest.approx(SPEC_MBPS, abs=0.0055)
    assert bianchi(1).throughput_bps == pytest.approx(8000 / (1275.818182e-6 + 310e-6), rel=1e-9)


def test_the_timing_of_a_layer_is_that_of_its_standard() -> None:
    timing = timing_of(physical_layer(MacConfig("ieee80211b")), 1028, 28)
    assert (timing.slot_us, timing.sifs_us, timing.difs_us, timing.delay_us) == (20, 10, 50, 1)
    assert (timing.ack_us, timing.rts_us, timing.cts_us) == (248, 272, 248)
    assert timing.payload_bits == 8000


def test_the_two_probabilities_agree() -> None:
    for n in STATIONS:
        model = bianchi(n)
        assert model.collision_probability == pytest.approx(
            1 - (1 - model.attempt_probability) ** (n - 1), abs=1e-9
        )
    assert bianchi(1).attempt_probability == 2 / 33


def test_a_collision_that_ends_with_an_eifs_costs_more() -> None:
    assert bianchi(1, silence_us=364).throughput_bps == pytest.approx(bianchi(1).throughput_bps, rel=1e-12)
    assert bianchi(20, silence_us=364).throughput_bps < bianchi(20).throughput_bps
    assert bianchi(20, silence_us=50).throughput_bps == bianchi(20).throughput_bps


@pytest.mark.parametrize("rts", [False, True])
@pytest.mark.parametrize(
    ("stations", "duration_s"), [(1, 6), (2, 4), (3, 4), (5, 4), (10, 4), (20, 3), (50, 3)]
)
def test_the_simulator_matches(stations: int, duration_s: float, rts: bool) -> None:
    """By the standard against the model with an EIFS after collisions, and as he assumes against his own."""
    tolerance = 0.01 if stations == 1 else 0.03
    standard = saturation(dcf(rts), stations, duration_s, seed=1)
    model = bianchi(stations, rts=rts, silence_us=EIFS_NS / 1000)
    assert standard.throughput_bps == pytest.approx(model.throughput_bps, rel=tolerance)
    if rts:
        return
    assumed = saturation(dcf(), stations, duration_s, seed=1, wait_after_loss=False)
    assert assumed.throughput_bps == pytest.approx(bianchi(stations).throughput_bps, rel=tolerance)
    collided = assumed.losses.get(Cause.COLLISION, 0) / assumed.attempts
    assert collided == pytest.approx(bianchi(stations).collision_probability, abs=0.02)


def test_stations_share_alike_and_a_seed_repeats() -> None:
    once = saturation(dcf(), 5, 4.0, seed=3)
    assert once == saturation(dcf(), 5, 4.0, seed=3)
    assert once != saturation(dcf(), 5, 4.0, seed=4)
    mean = sum(once.packets_by_node) / 5
    assert once.packets_by_node == pytest.approx([mean] * 5, rel=0.2)
    assert once.delivery_ratio == 1.0
    assert once.attempts - once.losses[Cause.COLLISION] == pytest.approx(once.packets, abs=5)


def test_only_dcf_can_leave_out_the_eifs() -> None:
    with pytest.raises(ValueError, match="ieee802154 has no EIFS"):
        saturation(NetworkConfig(), 1, 1.0, seed=0, wait_after_loss=False)
