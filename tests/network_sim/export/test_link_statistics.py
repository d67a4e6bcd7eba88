"""Links measured on a run: known answers of links whose rate, delay and losses were set."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from network_sim.config import NetworkConfig
from network_sim.export.link_statistics import Bursts, bursts_of, link_statistics
from network_sim.simulate import simulate
from network_sim.trace.log import NetworkTrace, Recorder
from network_sim.types import Cause, EventKind, to_ns
from packetmesh.settings import with_settings
from tests.network_sim.by_hand import trace_of


def run(*changes: str) -> NetworkTrace:
    return simulate(with_settings(NetworkConfig(), changes))


def test_a_trace_written_by_hand() -> None:
    """Packets of 1000 bytes: 2 s, 4 s after waiting for the first, lost after 2 s, then 4 s."""

    def story(recorder: Recorder) -> None:
        def record(t_s: float, kind: EventKind, packet: int, cause: Cause = Cause.NONE) -> None:
            where: dict[str, Any] = {"packet": packet, "image": 0, "size_bytes": 1000, "cause": cause}
            recorder.add(to_ns(t_s), kind, 0, 2, **where)

        for packet, (enters_s, leaves_s) in enumerate([(10, 12), (11, 16), (20, 22), (22, 26)]):
            record(enters_s, EventKind.ENQUEUE, packet)
            lost = packet == 2
            if lost:
                record(leaves_s, EventKind.DROP, packet, Cause.RETRIES)
            else:
                record(leaves_s, EventKind.DELIVER, packet)
        record(30, EventKind.ENQUEUE, 4)
        record(31, EventKind.DROP, 4, Cause.DEADLINE)  # the link did not lose it

    link = link_statistics(trace_of(story, warmup_s=0.0), 0)
    assert link is not None
    assert (link.packets, link.loss) == (4, 0.25)
    assert link.rate_bps == pytest.approx(4 * 8000 / 12)  # bits over 2 + 4 + 2 + 4 s
    assert link.one_way_s == pytest.approx((2 + 4 + 4) / 3)
    assert link.delay_s == pytest.approx((2 + 4 + 4) / 3 - 3)  # a packet takes 3 s at that rate
    assert link.jitter_s == pytest.approx(np.std([2, 4, 4]))
    assert link.bursts == Bursts(1 / 2, 1)
    assert link_statistics(trace_of(story, warmup_s=0.0), 1) is None


def test_an_ideal_link_is_measured_as_configured() -> None:
    trace = run("mac.kind=ideal", "mac.link_bps=1e6", "nodes.image_bytes=20000")
    link = link_statistics(trace, 1)
    assert link is not None
    assert link.rate_bps == pytest.approx(1e6, rel=1e-6)
    assert link.one_way_s == pytest.approx(20000 * 8 / 1e6 / link.packets, rel=1e-6)
    assert (link.loss, link.bursts) == (0.0, None)
    assert max(link.delay_s, link.jitter_s) < 1e-8


def test_a_lone_node_has_the_rate_of_the_specification() -> None:
    """SPEC 6.1: one saturated node sends 116 bytes in 6.880 ms on average."""
    link = link_statistics(run("nodes.count=1", "nodes.image_bytes=500000"), 0)
    assert link is not None
    assert link.rate_bps == pytest.approx(8 * 116 / 6.880e-3, rel=0.005)
    backoffs_s = 320e-6 * np.arange(8)  # the only part that varies
    assert link.jitter_s == pytest.approx(backoffs_s.std(), rel=0.03)


def test_losses_and_their_bursts_are_those_of_the_settings() -> None:
    changes = ("mac.kind=ideal", "nodes.retransmit=false", "nodes.image_bytes=3000000")
    link = link_statistics(run(*changes, "nodes.count=1", "loss.share=0.1", "loss.burst_packets=8"), 0)
    assert link is not None
    assert link.packets == -(-3_000_000 // 116)
    assert link.loss == pytest.approx(0.1, rel=0.1)
    assert link.bursts is not None
    assert link.bursts.end == pytest.approx(1 / 8, rel=0.07)
    assert link.bursts.begin == pytest.approx(1 / 8 * 0.1 / 0.9, rel=0.1)


def test_time_asleep_does_not_slow_the_link_down() -> None:
    awake, asleep = (
        link_statistics(run("nodes.count=1", "nodes.image_bytes=200000", *more), 0)
        for more in ((), ("nodes.duty_cycle=0.2", "nodes.duty_period_s=2"))
    )
    assert awake is not None
    assert asleep is not None
    assert asleep.rate_bps == pytest.approx(awake.rate_bps, rel=0.02)


def test_the_warm_up_does_not_count() -> None:
    trace = run("mac.kind=ideal", "nodes.image_bytes=200000", "run.warmup_s=3")
    whole = replace(trace, config=with_settings(trace.config, ["run.warmup_s=0"]))
    late, all_of_it = (link_statistics(one, 0) for one in (trace, whole))
    assert late is not None
    assert all_of_it is not None
    before = 3.0 * 250e3 / 8 / 116  # less those of up to 10 ms until the camera begins
    assert before - 4 < all_of_it.packets - late.packets <= before


@pytest.mark.parametrize(
    ("lost", "bursts"),
    [
        ("..x.xx..x", Bursts(3 / 5, 2 / 3)),
        ("....", None),
        ("xxxx", None),
        ("...x", None),
        ("x...", None),
    ],
)
def test_bursts_are_the_shares_of_transitions(lost: str, bursts: Bursts | None) -> None:
    assert bursts_of(np.array([letter == "x" for letter in lost])) == bursts
