"""Presets of radios in a star: the times in the user's guide, and runs in which much fails."""

import re
from pathlib import Path

import pytest

from network_sim.presets import PRESETS
from network_sim.simulate import simulate
from network_sim.trace.conservation import balance as packet_balance
from network_sim.trace.conservation import image_balance
from network_sim.types import EventKind
from packetmesh.settings import with_settings

ROW = re.compile(r"^\| `([\w-]+)` \| [^|]+ \| ([\d.]+) (s|h) \|$", re.MULTILINE)
TIMES = ROW.findall((Path(__file__).parents[2] / "docs" / "using.md").read_text(encoding="utf-8"))
ONE_IMAGE = (
    *("nodes.image_bytes=252000", "nodes.depth_bytes=0", "nodes.images=1", "nodes.interval_s=0"),
    *("nodes.deadline_s=none", "run.keep=images"),
)


def test_every_star_has_a_time():
    assert {"ble", "lte-m", "nb-iot", "lora"} < {preset for preset, _, _ in TIMES}


@pytest.mark.parametrize(("preset", "time", "unit"), TIMES)
def test_three_images_take_the_time_of_the_guide(preset, time, unit):
    trace = simulate(with_settings(PRESETS[preset], ONE_IMAGE))
    arrived = trace.events.of(EventKind.ARRIVE)
    decimals = len(time.partition(".")[2])
    assert len(arrived) == 3
    assert f"{arrived.t_ns.max() / {'s': 1e9, 'h': 3600e9}[unit]:.{decimals}f}" == time


@pytest.mark.parametrize("preset", ["wifi-n", "wifi-ax", "wifi-ah", "lora", "ble", "lte-m", "nb-iot"])
@pytest.mark.parametrize(
    "changes",
    [
        ["nodes.failures_per_h=60", "nodes.recovery_s=20", "loss.share=0.2"],
        ["nodes.duty_cycle=0.5", "nodes.duty_period_s=8", "loss.share=0.2"],
        ["nodes.retransmit=false", "loss.share=0.3", "loss.burst_packets=4", "mac.retries=1"],
        ["uplink.rate_bps=2e5", "uplink.loss=0.1", "nodes.buffer_packets=6", "mac.ack=true"],
    ],
)
def test_no_packet_is_lost_without_a_cause_whatever_fails(preset, changes):
    """``simulate`` checks every packet's history; here also that images arrive and that others are closed."""
    size = "2000" if preset == "lora" else "20000"
    common = [f"nodes.image_bytes={size}", "nodes.depth_bytes=0", "nodes.images=0", "run.horizon_s=900"]
    interval_s = 300.0 if preset == "lora" else 20.0
    times = [f"nodes.interval_s={interval_s}", f"nodes.deadline_s={interval_s}"]
    trace = simulate(with_settings(PRESETS[preset], [*common, *times, *changes]))
    balance = image_balance(trace)
    assert balance.received + sum(balance.dropped.values()) + balance.in_flight == balance.created
    assert balance.in_flight <= 6
    packets = packet_balance(trace)
    assert packets.received > 20
    assert packets.in_flight < 400
