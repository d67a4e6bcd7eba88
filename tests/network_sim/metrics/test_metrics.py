"""Metrics of a run that was worked out on paper."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from network_sim.config import Keep
from network_sim.metrics.coverage import road_coverage
from network_sim.metrics.metrics import metrics
from network_sim.trace.ledger import BINS_PER_DECADE, delays_of
from network_sim.trace.log import Recorder
from network_sim.types import Cause, EventKind, to_ns
from tests.network_sim.by_hand import random_run, small_run, trace_of

WIDTH = 10 ** (1 / BINS_PER_DECADE)
ON_PAPER = {
    "image_delivery_ratio": 2 / 4,
    "packet_delivery_ratio": 3 / 5,
    "image_delay_mean": (6 + 4) / 2,
    "image_delay_deviation": 2**0.5,
    "packet_delay_mean": (4 + 6 + 4) / 3,
    "goodput": 8 * (900 + 450) / 120,
    "throughput": 8 * 1500 / 120,
    "images_taken_per_minute": 2,
    "images_per_minute": 1,
    "attempts_lost": 2,
    "attempts_lost_collision": 1,
    "attempts_lost_range": 1,
    "attempts_lost_noise": 0,
    "collisions_per_delivery": 1 / 5,
    "packets_dropped": 1,
    "packets_dropped_retries": 1,
    "images_expired_deadline": 1,
    "airtime_share": (9.5 + 4 + 0.1) / 120,
    "frames": 8,
    "queue": (4 + 6 + 2 + 2 + 2 + 5 + 0.5) / 120,
    "energy_radio_sending": 9.5 + 4,
    "energy_radio_receiving": 2 * 4.1,
    "energy_radio_listening": 4 * ((120 - 9.5 - 4.1 - 10) + (120 - 4 - 10)),
    "energy_radio_sleeping": 8 * 20,
    "energy_platform_awake": 16 * 220,
    "energy_platform_sleeping": 32 * 20,
    "summary_bytes": 20,
    "request_bytes": 0,
}
SEEN_ON_PAPER = {"coverage": 2 / 4, "redundancy": 0.0}


@pytest.mark.parametrize("keep", ["all", "images", "counters"])
def test_the_small_run_gives_what_was_worked_out(keep: Keep) -> None:
    found = metrics(trace_of(small_run, keep))
    wanted = ON_PAPER | (SEEN_ON_PAPER if keep != "counters" else {})
    assert {name: found[name].value for name in wanted} == pytest.approx(wanted, rel=1e-12)
    assert set(SEEN_ON_PAPER) <= set(found) or keep == "counters"
    assert found["image_delay_median"].value == pytest.approx(4.0, rel=WIDTH - 1)
    assert found["image_delay_p95"].value == pytest.approx(6.0, rel=WIDTH - 1)
    radio_j = sum(found[f"energy_radio_{s}"].value for s in ("sending", "receiving", "listening", "sleeping"))
    assert found["energy_radio"].value == pytest.approx(radio_j)
    total_j = radio_j + found["energy_platform_awake"].value + found["energy_platform_sleeping"].value
    assert found["energy_total"].value == pytest.approx(total_j)
    assert found["energy_per_image"].value == pytest.approx(total_j / 2)


def test_the_lifetime_is_that_of_the_first_camera_to_go() -> None:
    """Camera 1 listens longer than camera 0 receives, and sends less: it is first to have used its 1000 J."""
    trace = trace_of(small_run)
    used_j = 1 * 4 + 4 * 106 + 8 * 10 + 16 * 110 + 32 * 10
    assert metrics(trace)["lifetime"].value == pytest.approx(120 * 1000 / used_j)
    energy = replace(trace.config.energy, battery_j=None)
    endless = replace(trace, config=replace(trace.config, energy=energy))
    assert "lifetime" not in metrics(endless)


def test_the_warm_up_is_left_out() -> None:
    found = metrics(trace_of(small_run, warmup_s=0.0))
    assert found["image_delivery_ratio"].value == pytest.approx(3 / 5)
    assert found["frames"].value == 9
    assert found["queue"].value == pytest.approx(23.5 / 180)


def test_what_waits_when_the_warm_up_ends_is_in_the_queue() -> None:
    def story(recorder: Recorder) -> None:
        for packet in range(2):
            recorder.add(to_ns(10), EventKind.ENQUEUE, 1, 2, packet)
        recorder.add(to_ns(20), EventKind.DROP, 1, 2, 0, cause=Cause.BUFFER)
        recorder.add(to_ns(90), EventKind.DROP, 1, 2, 1, cause=Cause.BUFFER)

    trace = trace_of(story)
    assert metrics(trace)["queue"].value == pytest.approx(30 / 120)
    assert "packet_delivery_ratio" not in metrics(trace)  # none was created after the warm-up


@pytest.mark.parametrize("warmup_s", [0.0, 17.25, 60.0])
def test_a_random_run_against_the_definitions(warmup_s: float) -> None:
    trace = trace_of(random_run(6), warmup_s=warmup_s)
    found, events, start_ns = metrics(trace), trace.events, to_ns(warmup_s)
    taken = events.of(EventKind.CAPTURE)
    arrived = events.of(EventKind.ARRIVE)
    began_ns = dict(zip(taken.image.tolist(), taken.t_ns.tolist(), strict=True))
    ends = zip(arrived.image.tolist(), arrived.t_ns.tolist(), strict=True)
    delays_s = [(t - began_ns[i]) / 1e9 for i, t in ends if began_ns[i] >= start_ns]
    assert found["image_delay_mean"].value == pytest.approx(np.mean(delays_s))
    assert found["image_delay_deviation"].value == pytest.approx(np.std(delays_s, ddof=1))
    for name, percent in (("median", 50), ("p95", 95)):
        exact = np.percentile(delays_s, percent, method="inverted_cdf")
        assert found[f"image_delay_{name}"].value == pytest.approx(exact, rel=WIDTH - 1)
    change = events.of(EventKind.ENQUEUE, EventKind.DELIVER, EventKind.DROP)
    length, held, last_ns = 0, 0, start_ns
    for t_ns, kind in zip(change.t_ns.tolist(), change.kind, strict=True):
        length += held * max(t_ns - last_ns, 0)
        held += 1 if kind == EventKind.ENQUEUE else -1
        last_ns = max(t_ns, start_ns)
    length += held * (trace.horizon_ns - last_ns)
    assert found["queue"].value == pytest.approx(length / (trace.horizon_ns - start_ns))


def test_every_way_of_keeping_gives_equal_numbers() -> None:
    full, images, counters = (
        metrics(trace_of(random_run(7), keep)) for keep in ("all", "images", "counters")
    )
    assert images == full
    assert set(full) - set(counters) == {"coverage", "coverage_pieces", "redundancy"}
    assert all(full[name] == metric for name, metric in counters.items())


def test_redundancy_counts_images_of_what_was_shown_already() -> None:
    def story(recorder: Recorder) -> None:
        for image, (t_s, cell) in enumerate(((70, 1), (72, 1), (72, 2), (81, 1), (83, 5))):
            recorder.add(to_ns(t_s), EventKind.CAPTURE, 0, cell, image=image, size_bytes=1000)
        for image in range(4):
            recorder.add(to_ns(100), EventKind.ARRIVE, 0, 2, image=image, size_bytes=1000)

    found = metrics(trace_of(story))
    assert found["coverage"].value == 3 / 4
    assert found["redundancy"].value == 1 / 4
    sights = road_coverage(trace_of(story))
    for t_s, seen, covered in (
        (71, [0, 1, 0], [0, 0, 0]),
        (99, [0, 2, 1], [0, 0, 0]),
        (100, [0, 2, 1], [0, 2, 1]),
    ):
        for found, wanted in zip(sights.counts(to_ns(t_s), 6), (seen, covered), strict=True):
            assert found[:3].tolist() == wanted
    assert sights.counts(to_ns(100), 6)[0][5] == 1  # seen, and none of its images came


def test_a_run_within_its_warm_up_has_no_metrics() -> None:
    trace = trace_of(small_run)
    assert metrics(replace(trace, horizon_ns=to_ns(60))) == {}


def test_every_metric_has_a_known_unit_and_a_definition_of_its_own() -> None:
    found = metrics(trace_of(small_run))
    assert {metric.unit for metric in found.values()} == {"1", "s", "bit/s", "1/min", "J", "B/min"}
    assert len({metric.definition for metric in found.values()}) == len(found)
    assert all(np.isfinite(metric.value) for metric in found.values())


@settings(max_examples=60)
@given(st.lists(st.floats(2e-6, 9e5), min_size=1, max_size=80), st.floats(0.0, 100.0, exclude_min=True))
def test_percentiles_are_within_a_bin(times_s: list[float], percent: float) -> None:
    times_ns = np.array([to_ns(t_s) for t_s in times_s])
    exact_s = np.sort(times_ns)[int(np.ceil(max(percent / 100 * len(times_ns), 1))) - 1] / 1e9
    found_s = delays_of(times_ns).percentile_s(percent)
    assert exact_s / WIDTH * (1 - 1e-9) <= found_s <= exact_s * WIDTH * (1 + 1e-9)


def test_no_delays_have_no_mean_or_percentile() -> None:
    empty = delays_of(np.zeros(0, np.int64))
    assert np.isnan([empty.mean_s, empty.deviation_s, empty.percentile_s(50)]).all()
