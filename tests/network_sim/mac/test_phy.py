"""Airtimes of IEEE 802.11n, 802.11ax and 802.11ah: by hand from the standards, and those that ns-3 gives."""

from __future__ import annotations

import pytest

from network_sim.config import MacConfig, NetworkConfig, NodesConfig
from network_sim.mac import ieee80211ah, ieee80211ax, ieee80211b, ieee80211n, physical_layer
from network_sim.mac.phy import ACK_BYTES, BLOCK_ACK_BYTES, legacy
from network_sim.radio.ofdm import BY_MCS, SCHEMES, bit_error_rate, sensitivity_dbm
from network_sim.settings.mac import AH_PAYLOAD_BYTES
from packetmesh.errors import InputError

N, AX, AH = "ieee80211n", "ieee80211ax", "ieee80211ah"
NS3_US = {
    (N, 0, 0.8): (66.0, 142.0, 1938.0),
    (N, 4, 0.8): (46.0, 62.0, 358.0),
    (N, 7, 0.8): (46.0, 54.0, 234.0),
    (AX, 0, 1.6): (78.8, 136.4, 1576.4),
    (AX, 5, 1.6): (64.4, 64.4, 251.6),
    (AX, 9, 1.6): (64.4, 64.4, 165.2),
    (AX, 11, 1.6): (64.4, 64.4, 150.8),
}
"""Frames of 14, 76 and 1536 bytes at 2.4 GHz: ``WifiPhy::CalculateTxDuration`` of ns-3 3.44, 20 MHz, one
stream. Its HE-LTF takes 8 us whatever the guard interval, which is right for 1.6 us."""


@pytest.mark.parametrize(("kind", "mcs", "guard_us"), NS3_US)
def test_frames_last_as_long_as_in_ns3(kind: str, mcs: int, guard_us: float) -> None:
    mac = MacConfig(kind=kind, mcs=mcs, guard_us=guard_us)
    module = ieee80211n if kind == N else ieee80211ax
    found_us = tuple(module.waveform(mac).air_ns(size) / 1e3 for size in (14, 76, 1536))
    assert found_us == NS3_US[kind, mcs, guard_us]


@pytest.mark.parametrize(
    ("mac", "size_bytes", "us"),
    [
        # 36 + 4 ceil((8 L + 22) / N_DBPS) + 6
        (MacConfig(N, mcs=7), 1536, 36 + 4 * 48 + 6),
        (MacConfig(N, mcs=3), 1000, 36 + 4 * 78 + 6),
        (MacConfig(N, mcs=0), 100, 36 + 4 * 32 + 6),
        (MacConfig(N, mcs=7, guard_us=0.4), 1536, 36 + 176 + 6),  # 48 symbols of 3.6 us are 172.8: 44 of 4 us
        # 36 + HE-LTF + symbols of 12.8 us and the guard interval + 6
        (MacConfig(AX, mcs=9), 1536, 36 + 7.2 + 13.6 * 8 + 6),
        (MacConfig(AX, mcs=0, guard_us=3.2), 1000, 36 + 16 + 16 * 69 + 6),
        (MacConfig(AX, mcs=11, guard_us=1.6), 65535, 36 + 8 + 14.4 * 269 + 6),
        (MacConfig(AX, mcs=11), 4873, 36 + 7.2 + 13.6 * 20 + 6),  # 20 symbols to the bit, as LDPC has no tail
        (MacConfig(AX, mcs=9), 4873, 36 + 7.2 + 13.6 * 26 + 6),
        # preamble + 40 ceil((8 L + 14) / N_DBPS)
        (MacConfig(AH, mcs=7), 1538, 240 + 40 * 48),
        (MacConfig(AH, mcs=0), 256, 240 + 40 * 80),
        (MacConfig(AH, mcs=0, bandwidth_hz=1e6), 256, 560 + 40 * 172),
        (MacConfig(AH, mcs=7, bandwidth_hz=1e6), 256, 560 + 40 * 18),
        (MacConfig(AH, mcs=10, bandwidth_hz=1e6), 511, 27_920),  # the longest frame of all (aPPDUMaxTime)
    ],
)
def test_frames_last_as_long_as_the_standard_says(mac: MacConfig, size_bytes: int, us: float) -> None:
    assert physical_layer(mac).data.air_ns(size_bytes) == round(1000 * us)


@pytest.mark.parametrize(
    ("kind", "mbps"),
    [
        (N, [6.5, 13, 19.5, 26, 39, 52, 58.5, 65]),
        (AX, [8.6, 17.2, 25.8, 34.4, 51.6, 68.8, 77.4, 86.0, 103.2, 114.7, 129.0, 143.4]),
        (AH, [0.65, 1.3, 1.95, 2.6, 3.9, 5.2, 5.85, 6.5]),
    ],
)
def test_rates_are_those_by_which_the_mcs_are_known(kind: str, mbps: list[float]) -> None:
    data = [physical_layer(MacConfig(kind, mcs=mcs)).data for mcs in range(len(mbps))]
    assert [1e3 * one.bits_per_symbol / one.symbol_ns for one in data] == pytest.approx(mbps, abs=0.05)


def test_rates_of_one_megahertz() -> None:
    layers = {mcs: physical_layer(MacConfig(AH, mcs=mcs, bandwidth_hz=1e6)) for mcs in (10, 0, 7)}
    assert {mcs: layer.data.bits_per_symbol / 40 for mcs, layer in layers.items()} == {
        10: 0.15,
        0: 0.3,
        7: 3.0,
    }


def test_answers_of_basic_rates() -> None:
    us = {
        rate: [legacy(rate).air_ns(size) / 1e3 for size in (ACK_BYTES, BLOCK_ACK_BYTES)]
        for rate in (6e6, 24e6)
    }
    assert us == {6e6: [44 + 6, 68 + 6], 24e6: [28 + 6, 32 + 6]}
    answers = [physical_layer(MacConfig(N, mcs=mcs)).ack.duration_ns for mcs in range(8)]
    assert answers == [50_000, 38_000, 38_000, *[34_000] * 5]
    assert physical_layer(MacConfig(AX, mcs=9, ampdu_packets=65)).answer(2).size_bytes == 56
    for bandwidth_hz, us_of_ndp in ((1e6, 560), (2e6, 240)):
        layer = physical_layer(MacConfig(AH, bandwidth_hz=bandwidth_hz))
        assert {layer.cts, layer.ack, layer.block_ack} == {layer.ack}
        assert (layer.ack.size_bytes, layer.ack.duration_ns) == (0, 1000 * us_of_ndp)


def test_interframe_spaces() -> None:
    for kind in (N, AX):
        layer = physical_layer(MacConfig(kind))
        assert (layer.slot_ns, layer.gap_ns, layer.difs_ns) == (9_000, 10_000, 37_000)
        assert layer.eifs_ns == 10_000 + 50_000 + 37_000
        assert layer.reply_wait_ns == 10_000 + 9_000 + 20_000
        assert (layer.min_window, layer.max_window) == (16, 1024)
    layer = physical_layer(MacConfig(AH))
    assert (layer.slot_ns, layer.gap_ns, layer.difs_ns) == (52_000, 160_000, 316_000)
    layer = physical_layer(MacConfig("ieee80211b"))
    assert (layer.slot_ns, layer.gap_ns, layer.difs_ns, layer.eifs_ns) == (20_000, 12_000, 50_000, 364_000)
    assert layer.reply_wait_ns == 224_000


def test_packets_of_a_frame_have_delimiters_and_are_padded_to_four_bytes() -> None:
    n, ax, ah = (physical_layer(MacConfig(kind)) for kind in (N, AX, AH))
    # 38 bytes of headers: 100 -> 138 -> 140, 101 -> 139 -> 140, 102 -> 140, 103 -> 141 -> 144
    assert n.subframes_bytes([100, 101, 102, 103, 103]) == [144, 144, 144, 148, 145]
    assert (n.subframes_bytes([100]), ax.subframes_bytes([100])) == ([138], [142])
    assert (ah.subframes_bytes([473]), ah.subframes_bytes([474])) == ([511], [4 + 512])
    assert physical_layer(MacConfig("ieee80211b")).subframes_bytes([100]) == [136]
    assert n.frame_ns([1500] * 3) == ieee80211n.waveform(MacConfig(N)).air_ns(1544 + 1544 + 1542)


@pytest.mark.parametrize(
    "mac", [MacConfig(N), MacConfig(N, guard_us=0.4), MacConfig(AX), MacConfig(AH, mcs=2)]
)
def test_the_largest_frame_of_a_duration_is_the_largest(mac: MacConfig) -> None:
    data = physical_layer(mac).data
    for duration_ns in (data.air_ns(1), 1_000_000, 4_321_000):
        most = data.most_bytes(duration_ns)
        assert data.air_ns(most) <= duration_ns < data.air_ns(most + 1)


def test_payloads_of_802_11ah_fit_its_length_field() -> None:
    """511 bytes in a frame of one packet without delimiter, or 511 symbols."""
    for bandwidth_hz in (1e6, 2e6):
        for mcs in (*range(8), *([10] if bandwidth_hz == 1e6 else [])):
            mac = MacConfig(AH, mcs=mcs, bandwidth_hz=bandwidth_hz)
            bits = ieee80211ah.MOST_SYMBOLS * physical_layer(mac).data.bits_per_symbol
            fits = max(511 - 38, (bits - 14) // 8 - 4 - 38)
            assert mac.max_payload_bytes == min(2304, fits)
            assert mac.max_payload_bytes == AH_PAYLOAD_BYTES.get((bandwidth_hz, mcs), 2304)
            assert sum(physical_layer(mac).subframes_bytes([mac.max_payload_bytes])) <= max(
                511, (bits - 14) // 8
            )


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"kind": N, "mcs": 8}, "mac.mcs is 8, which ieee80211n does not have; try one of 0, 1"),
        ({"kind": AH, "mcs": 10}, "mac.mcs is 10, which ieee80211ah with mac.bandwidth_hz=2e"),
        ({"kind": N, "guard_us": 1.6}, "mac.guard_us is 1.6; try one of 0.8, 0.4"),
        ({"kind": N, "ampdu_packets": 65}, "of ieee80211n answers 64"),
        ({"kind": AH, "bandwidth_hz": 1e6, "ampdu_packets": 9}, "of ieee80211ah answers 8"),
        ({"kind": AH, "bandwidth_hz": 4e6}, "mac.bandwidth_hz is 4"),
    ],
)
def test_what_a_standard_does_not_have_is_one_sentence(changes: dict[str, object], words: str) -> None:
    with pytest.raises(InputError) as caught:
        MacConfig(**changes)  # type: ignore[arg-type]
    assert words in str(caught.value)


def test_vehicles_and_packets_that_are_too_long_are_one_sentence() -> None:
    with pytest.raises(InputError, match="ieee80211n, which puts several packets into a frame"):
        NetworkConfig(scenario="street-grid", mac=MacConfig(N))
    with pytest.raises(InputError, match=r"carries 473 with mac.mcs=10 and mac.bandwidth_hz=1e\+06"):
        NetworkConfig(mac=MacConfig(AH, mcs=10, bandwidth_hz=1e6), nodes=NodesConfig(payload_bytes=474))


def test_sensitivities_are_those_of_the_standards() -> None:
    assert [sensitivity_dbm(name, 20e6) for name in BY_MCS] == pytest.approx(
        [-82, -79, -77, -74, -70, -66, -65, -64, -59, -57, -54, -52], abs=0.02
    )
    assert [sensitivity_dbm(name, 2e6) for name in BY_MCS[:8]] == pytest.approx(
        [-92, -89, -87, -84, -80, -76, -75, -74], abs=0.02
    )
    assert sensitivity_dbm("2 x bpsk 1/2", 1e6) == pytest.approx(-98, abs=0.02)


@pytest.mark.parametrize("name", SCHEMES)
def test_frames_begin_to_arrive_near_the_ratio_that_the_standards_imply(name: str) -> None:
    """Frames of 1000 bytes; the code is decoded by hard decisions here, and a little worse than a real
    one."""
    scheme = SCHEMES[name]
    ratios = [10 ** ((scheme.needed_db + more_db) / 10) for more_db in (2.5, -2.5)]
    good, bad = (1.0 - (1.0 - bit_error_rate(one, scheme)) ** 8000 for one in ratios)
    assert good < 0.1 < 0.9 < bad


def test_bit_errors_follow_the_union_bound() -> None:
    """BPSK with rate 1/2 at 5 dB: p = erfc(10^0.25) / 2 = .005954, and the bound by hand."""
    wrong = 0.0059538672
    spread = 4 * wrong * (1 - wrong)
    by_hand = 0.5 * (36 * spread**5 + 211 * spread**6 + 1404 * spread**7 + 11633 * spread**8)
    assert bit_error_rate(10**0.5, SCHEMES["bpsk 1/2"]) == pytest.approx(by_hand, rel=1e-2)
    twice = bit_error_rate(10**0.5 / 2, SCHEMES["2 x bpsk 1/2"])
    assert twice == pytest.approx(bit_error_rate(10**0.5, SCHEMES["bpsk 1/2"]), rel=1e-9)
    # 16-QAM: 3/8 erfc(sqrt(snr / 10)) wrong bits before decoding
    wrong = 0.375 * 0.0014334946  # erfc(sqrt(5.0811))
    spread = (4 * wrong * (1 - wrong)) ** 0.5
    by_hand = (42 * spread**5 + 201 * spread**6 + 1492 * spread**7 + 10469 * spread**8) / 6
    assert bit_error_rate(50.811, SCHEMES["16-qam 3/4"]) == pytest.approx(by_hand, rel=2e-2)


def test_rates_of_802_11b() -> None:
    for rate_bps in (1e6, 2e6, 5.5e6, 11e6):
        for size in (14, 20, 1064, 2340):
            expected = 192_000 + round(8e9 * size / rate_bps)
            assert ieee80211b.waveform(rate_bps).air_ns(size) == expected
