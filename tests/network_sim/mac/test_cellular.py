"""LTE-M and NB-IoT: blocks and gaps of the standard, shared carriers, and repeated blocks."""

from __future__ import annotations

import numpy as np
import pytest

from network_sim.config import NetworkConfig
from network_sim.mac.nb_iot import block_ns
from network_sim.mac.saturation import saturation
from network_sim.presets import PRESETS
from network_sim.simulate import simulate
from network_sim.types import Cause, EventKind
from packetmesh.errors import InputError
from packetmesh.settings import with_settings
from tests.network_sim.mac.star_scene import StarScene

MS = 1_000_000
BLOCK_BYTES = 125
"""1000 bits."""


def config(preset: str, *changes: str) -> NetworkConfig:
    return with_settings(PRESETS[preset], ["loss.share=0", "nodes.header_bytes=0", *changes])


def rate_bps(own: NetworkConfig, nodes: int, duration_s: float = 8.0) -> float:
    """Throughput in bits of transport blocks."""
    return saturation(own, nodes, duration_s, seed=1).throughput_bps * BLOCK_BYTES / own.nodes.payload_bytes


@pytest.mark.parametrize(("nodes", "kbit_s"), [(1, 375.0), (2, 750.0), (3, 1000.0), (10, 1000.0)])
def test_half_duplex_modules_of_lte_m_carry_375_kbit_s_each_up_to_the_carriers_1000(nodes, kbit_s):
    assert rate_bps(config("lte-m"), nodes) == pytest.approx(1e3 * kbit_s, rel=0.01)


@pytest.mark.parametrize("nodes", [1, 4])
def test_full_duplex_modules_fill_the_carrier(nodes):
    assert rate_bps(config("lte-m", "mac.full_duplex=true"), nodes) == pytest.approx(1e6, rel=0.01)


@pytest.mark.parametrize(
    ("tones", "nodes", "cycle_ms", "at_once"),
    [
        (12, 1, 16, 1),
        (12, 4, 16, 4),
        (12, 9, 4, 1),
        (6, 1, 20, 1),
        (3, 1, 28, 1),
        (3, 20, 4, 1),
        (1, 1, 60, 1),
    ],
)
def test_nb_iot_carries_a_block_in_each_cycle_of_grant_block_and_gaps(tones, nodes, cycle_ms, at_once):
    """On 12 subcarriers 1 + 8 + 4 + 3 ms, the 62.5 kbit/s of category NB1; on one 1 + 8 + 48 + 3 ms. A full
    carrier sends a block in 4 ms; four blocks on 3 subcarriers take 16 ms."""
    expected_bps = at_once * 1000 / (cycle_ms / 1e3)
    assert rate_bps(config("nb-iot", f"mac.tones={tones}"), nodes, 20.0) == pytest.approx(
        expected_bps, rel=0.01
    )


@pytest.mark.parametrize(
    ("size_bytes", "tones", "ms"),
    [
        (125, 12, 4),
        (85, 12, 3),
        (86, 12, 4),
        (55, 12, 2),
        (26, 12, 1),
        (125, 6, 8),
        (125, 3, 16),
        (125, 1, 48),
        (109, 1, 40),
        (110, 1, 48),
        (18, 1, 8),
    ],
)
def test_a_block_takes_the_fewest_resource_units_of_the_table(size_bytes, tones, ms):
    """36.213, Table 16.5.1.2-2: I_TBS 12 has 208, 440, 680, 1000 bits, I_TBS 10 has 144, 328, 504, 680, 872,
    1000."""
    assert block_ns(size_bytes, tones) == ms * MS


@pytest.mark.parametrize(
    ("preset", "nodes", "kbit_s", "duration_s"),
    [("lte-m", 1, 375.0, 30.0), ("lte-m", 5, 1000.0, 12.0), ("nb-iot", 3, 187.5, 60.0)],
)
def test_losses_cost_the_share_that_is_lost(preset, nodes, kbit_s, duration_s):
    """Each block is repeated in a grant of its own; one in a thousand is given up after five."""
    lossy_bps = rate_bps(config(preset, "loss.share=0.25"), nodes, duration_s)
    assert lossy_bps == pytest.approx(750.0 * kbit_s, rel=0.02)


@pytest.mark.parametrize(
    ("preset", "first_ms", "starts_ms"),
    [
        ("lte-m", 8, [0, 1, 2, 8, 9, 10, 16, 17]),
        ("nb-iot", 9, [0, 16, 32, 48, 64, 80, 96, 112]),
    ],
)
def test_a_nodes_blocks_begin_as_the_standard_grants_them(preset, first_ms, starts_ms):
    scene = StarScene(config(preset), [10.0])
    scene.send_all(0, 0, range(8), config(preset).nodes.payload_bytes)
    frames = scene.run().of(EventKind.AIR)
    assert (frames.t_ns / MS).tolist() == [first_ms + start_ms for start_ms in starts_ms]
    assert set(frames.size_bytes.tolist()) == {BLOCK_BYTES}
    assert [(outcome.ok, number) for _, number, outcome in scene.outcomes] == [(True, n) for n in range(8)]


@pytest.mark.parametrize(
    ("preset", "changes", "later_ms"),
    [
        ("lte-m", [], 8),
        ("lte-m", ["mac.full_duplex=true"], 8),
        ("nb-iot", [], 16),
        ("nb-iot", ["mac.tones=3"], 28),
    ],
)
def test_a_lost_block_is_sent_again_five_times_at_most(preset, changes, later_ms):
    scene = StarScene(config(preset, "loss.share=1", *changes), [10.0])
    scene.send(0, 0, 0, 120)
    events = scene.run()
    assert (np.diff(events.of(EventKind.AIR).t_ns) / MS).tolist() == [later_ms] * 4
    assert scene.outcomes[0][2][:3] == (False, Cause.RETRIES, 5)
    assert set(events.of(EventKind.LOSS).cause.tolist()) == {Cause.LINK}


@pytest.mark.parametrize(
    ("preset", "changes", "lanes"),
    [("lte-m", [], 1), ("nb-iot", [], 1), ("nb-iot", ["mac.tones=3"], 4), ("nb-iot", ["mac.tones=1"], 12)],
)
def test_no_more_blocks_are_on_the_air_than_the_carrier_holds_and_one_of_each_node(preset, changes, lanes):
    scene = StarScene(config(preset, "loss.share=0.2", *changes), [10.0] * 15)
    for node in range(15):
        scene.send_all(node, node * 3 * MS + 17, range(100 * node, 100 * node + 25), 120)
    frames = scene.run().of(EventKind.AIR)
    ends_ns = frames.t_ns + frames.duration_ns
    at_once = [int(((frames.t_ns <= t_ns) & (ends_ns > t_ns)).sum()) for t_ns in frames.t_ns]
    assert max(at_once) == lanes
    assert (frames.t_ns % MS == 0).all()
    assert len(set(frames.t_ns.tolist())) == len(frames)  # one grant in a subframe
    for node in range(15):
        own = frames.node == node
        assert (frames.t_ns[own][1:] >= ends_ns[own][:-1]).all()
    served = {int(node): int((frames.node[: len(frames) // 2] == node).sum()) for node in range(15)}
    assert max(served.values()) <= 2 * min(served.values()) + 3


def test_a_node_that_is_down_gives_back_what_it_has():
    scene = StarScene(config("lte-m", "loss.share=1"), [10.0])
    scene.send_all(0, 0, range(2), 120)
    scene.turn_off(0, 8 * MS + 1)
    scene.run()
    assert {outcome[:2] for _, _, outcome in scene.outcomes} == {(False, Cause.NODE_DOWN)}
    assert len(scene.outcomes) == 2


def test_the_office_by_nb_iot_takes_as_long_as_its_blocks():
    """252,000 bytes of 110 in a block, 16 ms each, a tenth of them twice."""
    trace = simulate(with_settings(PRESETS["nb-iot"], ["nodes.images=1", "nodes.interval_s=0"]))
    arrived = trace.events.of(EventKind.ARRIVE)
    assert len(arrived) == 3
    np.testing.assert_allclose(arrived.t_ns / 1e9, -(-252_000 // 110) * 0.016 / 0.9, rtol=0.02)


@pytest.mark.parametrize(
    "change", ["nodes.payload_bytes=121", "mac.tones=4", "scenario=street-grid", "mac.spreading_factor=13"]
)
def test_what_the_standard_does_not_have_is_one_sentence(change):
    with pytest.raises(InputError, match=r"try|carries 120"):
        config("lte-m", change)
