"""Whole runs of the street grid (SPEC 6.2): the numbers without a radio, trends, what must always hold.

SPEC's numbers come from a grid of 6 x 6 crossings: with it, summaries take the 1220 B/min per vehicle that it
gives. Its PDC levels off at 6 x 120 images a minute, so it had 120 cells: the 60 streets have as many when a
cell is a whole street in one direction. The pieces of 100 m in one direction that it asks for are 240.
"""

from dataclasses import replace
from functools import cache
from itertools import pairwise

import numpy as np
import pytest

from network_sim.config import MacConfig, NetworkConfig, RadioConfig, RunConfig, SchemeConfig, StreetConfig
from network_sim.mac.medium import Medium
from network_sim.metrics.metrics import metrics
from network_sim.simulate import simulate
from network_sim.street.street import street_of
from network_sim.trace.conservation import balance, check
from network_sim.trace.log import NetworkTrace
from network_sim.types import NS_PER_S, Cause, EventKind, PacketKind, to_ns

WARMUP_S = 900.0
HORIZON_S = 2400.0


def _config(name: str, vehicles: int, k: int | None = None, directed: bool = True, **run) -> NetworkConfig:
    return NetworkConfig(
        scenario="street-grid",
        mac=MacConfig(kind="ideal", link_bps=11e6),
        scheme=SchemeConfig(name=name, k=k, directed_cells=directed),
        street=StreetConfig(vehicles=vehicles, blocks=5),
        run=RunConfig(**{"horizon_s": HORIZON_S, "warmup_s": WARMUP_S, "keep": "images", "seed": 1} | run),
    )


@cache
def _run(name: str, vehicles: int, k: int | None = None, directed: bool = True) -> NetworkTrace:
    trace = simulate(_config(name, vehicles, k, directed))
    check(trace)
    return trace


def _images_per_min(trace: NetworkTrace) -> float:
    arrived = trace.events.of(EventKind.ARRIVE)
    return 60.0 * float((arrived.t_ns >= to_ns(WARMUP_S)).sum()) / (HORIZON_S - WARMUP_S)


def _bytes_per_min(trace: NetworkTrace, kind: PacketKind) -> float:
    counters = trace.counters
    sent = counters.size_bytes[counters.warmup_minutes :, EventKind.RECEIVE, kind].sum()
    return 60.0 * float(sent) / (HORIZON_S - WARMUP_S)


def _coverage(trace: NetworkTrace) -> float:
    """Of what was taken at least ten minutes before the end."""
    taken = trace.events.of(EventKind.CAPTURE)
    taken = taken.where((taken.t_ns >= to_ns(WARMUP_S)) & (taken.t_ns < to_ns(HORIZON_S - 600.0)))
    arrived = np.isin(taken.image, trace.events.of(EventKind.ARRIVE).image)
    windows = taken.peer.astype(np.int64) * 10**6 + taken.t_ns // to_ns(10.0)
    return len(np.unique(windows[arrived])) / len(np.unique(windows))


@pytest.mark.parametrize(
    ("vehicles", "baseline", "greedy", "pdc"),
    [(10, 298, 119, 294), (20, 594, 215, 541), (40, 1192, 376, 742)],
)
def test_the_numbers_without_a_radio(vehicles: int, baseline: float, greedy: float, pdc: float) -> None:
    for name, images_per_min in (("baseline", baseline), ("greedy", greedy), ("pdc", pdc)):
        trace = _run(name, vehicles, directed=name == "baseline")
        assert _images_per_min(trace) == pytest.approx(images_per_min, rel=0.1)


def test_more_vehicles_bring_more_images() -> None:
    for name in ("baseline", "greedy", "pdc"):
        rates = [_images_per_min(_run(name, vehicles)) for vehicles in (10, 20, 40)]
        assert rates == sorted(rates)


@pytest.mark.parametrize("vehicles", [20, 40])
def test_baseline_brings_more_than_pdc_and_pdc_more_than_greedy(vehicles: int) -> None:
    baseline, pdc, greedy = (_images_per_min(_run(name, vehicles)) for name in ("baseline", "pdc", "greedy"))
    assert baseline > pdc >= greedy


@pytest.mark.parametrize("vehicles", [20, 40])
def test_greedy_covers_nearly_as_much_with_less_than_half_the_images(vehicles: int) -> None:
    greedy, baseline = _run("greedy", vehicles), _run("baseline", vehicles)
    assert _images_per_min(greedy) <= 0.5 * _images_per_min(baseline)
    assert _coverage(greedy) >= 0.85 * _coverage(baseline)
    assert _coverage(baseline) >= 0.96


def test_a_smaller_k_means_fewer_images_and_less_request_traffic() -> None:
    traces = [_run("greedy", 40, k) for k in (3, 5, 10, 20, None)]
    images = [_images_per_min(trace) for trace in traces]
    requests = [_bytes_per_min(trace, PacketKind.REQUEST) for trace in traces]
    coverage = [_coverage(trace) for trace in traces]
    for values in (images, requests, coverage):
        assert all(smaller < larger for smaller, larger in pairwise(values))
    assert images[1] == pytest.approx(130, rel=0.25)
    assert images[3] == pytest.approx(317, rel=0.25)


@pytest.mark.parametrize("vehicles", [10, 20, 40])
def test_summaries_are_the_same_for_all_schemes(vehicles: int) -> None:
    sizes = [
        _bytes_per_min(_run(name, vehicles), PacketKind.SUMMARY) for name in ("baseline", "greedy", "pdc")
    ]
    assert sizes == pytest.approx([sizes[0]] * 3, rel=0.02)
    assert sizes[0] / vehicles == pytest.approx(1220, rel=0.08)
    assert _bytes_per_min(_run("baseline", vehicles), PacketKind.REQUEST) == 0


def test_pdc_levels_off_where_every_cell_is_covered_once() -> None:
    rates = [_images_per_min(_run("pdc", vehicles, directed=False)) for vehicles in (40, 80)]
    assert rates == pytest.approx([6 * 120] * 2, rel=0.1)


def test_pdc_received_turns_itself_down() -> None:
    fewer, all_images = _run("pdc-received", 40, directed=False), _run("baseline", 40)
    assert _images_per_min(fewer) < 0.8 * _images_per_min(all_images)


def test_images_are_taken_at_their_interval_and_thrown_out_of_a_full_buffer() -> None:
    config = _config("baseline", 3)
    config = NetworkConfig(
        scenario="street-grid",
        mac=config.mac,
        scheme=SchemeConfig(buffer_images=20),
        street=config.street,
        run=config.run,
    )
    trace = simulate(config)
    check(trace)
    taken, thrown = trace.events.of(EventKind.CAPTURE), trace.events.of(EventKind.EXPIRE)
    arrived = trace.events.of(EventKind.ARRIVE)
    captured_ns = dict(zip(taken.image.tolist(), taken.t_ns.tolist(), strict=True))
    for vehicle in range(3):
        assert set(np.diff(taken.t_ns[taken.node == vehicle])) == {2 * NS_PER_S}
    assert set(thrown.cause) == {Cause.BUFFER}
    ages_ns = [
        t_ns - captured_ns[image]
        for image, t_ns in zip(thrown.image.tolist(), thrown.t_ns.tolist(), strict=True)
    ]
    assert set(ages_ns) == {to_ns(40.0)}
    assert not set(thrown.image) & set(arrived.image)
    ages_ns = [
        t_ns - captured_ns[image]
        for image, t_ns in zip(arrived.image.tolist(), arrived.t_ns.tolist(), strict=True)
    ]
    assert to_ns(38.0) < max(ages_ns) < to_ns(40.0) + to_ns(0.1), (
        "sent from the buffer, or already on the air"
    )


def test_a_large_image_arrives_with_its_last_fragment() -> None:
    config = _config("greedy", 3)
    config = NetworkConfig(
        scenario="street-grid",
        mac=MacConfig(kind="ieee80211b"),
        scheme=SchemeConfig(name="greedy", image_bytes=30_000),
        street=config.street,
        run=RunConfig(horizon_s=600.0, seed=2),
    )
    trace = simulate(config)
    arrived, received = trace.events.of(EventKind.ARRIVE), trace.events.of(EventKind.RECEIVE)
    assert len(arrived) > 20
    for image, t_ns in zip(arrived.image.tolist(), arrived.t_ns.tolist(), strict=True):
        parts = received.where(received.image == image)
        assert parts.first_byte.tolist() == list(range(0, 30_000, 1472))
        assert parts.size_bytes.sum() == 30_000 + 28 * len(parts)
        assert parts.t_ns[-1] == t_ns


def test_vehicles_send_only_while_in_range() -> None:
    trace = simulate(_config("baseline", 6, keep="all", horizon_s=900.0, warmup_s=0.0))
    events = trace.events
    for vehicle in range(6):
        mine = events.where(events.node == vehicle)
        joins, leaves = mine.of(EventKind.JOIN), mine.of(EventKind.LEAVE)
        ends_ns = np.append(leaves.t_ns, trace.horizon_ns)[: len(joins)]
        assert (joins.t_ns < ends_ns).all()
        sent = mine.of(EventKind.ENQUEUE)
        meeting = np.searchsorted(joins.t_ns, sent.t_ns, side="right") - 1
        assert (meeting >= 0).all()
        assert (sent.t_ns < ends_ns[meeting]).all()
        assert (sent.peer == joins.peer[meeting]).all()
        summaries = sent.where(sent.packet_kind == PacketKind.SUMMARY)
        gaps_ns = np.diff(summaries.t_ns)
        assert ((gaps_ns < to_ns(0.1)) | (gaps_ns >= to_ns(9.9))).all()


def test_a_vehicle_in_range_of_two_access_points_stays_with_the_first() -> None:
    config = _config("greedy", 4, horizon_s=600.0, warmup_s=0.0, keep="all")
    config = NetworkConfig(
        scenario="street-grid",
        radio=RadioConfig(range_m=450.0, sense_range_m=900.0),
        mac=config.mac,
        scheme=config.scheme,
        street=config.street,
        run=config.run,
    )
    trace = simulate(config)
    check(trace)
    for vehicle in range(4):
        mine = trace.events.where(trace.events.node == vehicle).of(EventKind.JOIN, EventKind.LEAVE)
        assert (mine.kind[::2] == EventKind.JOIN).all()
        assert (mine.kind[1::2] == EventKind.LEAVE).all()
        assert (mine.peer[: len(mine) // 2 * 2 : 2] == mine.peer[1::2]).all()


@pytest.mark.parametrize("name", ["baseline", "greedy", "pdc", "pdc-received"])
def test_the_same_seed_gives_the_same_trace(name: str) -> None:
    config = _config(name, 5, keep="all", horizon_s=900.0, warmup_s=300.0)
    other = replace(config, run=replace(config.run, seed=2))
    first, again, different = (
        [column.tobytes() for column in simulate(each).events.columns()] for each in (config, config, other)
    )
    assert first == again != different


def _contending(name: str) -> NetworkConfig:
    config = _config(name, 30, keep="all", horizon_s=300.0, warmup_s=0.0)
    return replace(config, mac=MacConfig(kind="ieee80211b"))


@pytest.mark.parametrize("name", ["baseline", "greedy", "pdc"])
def test_over_contending_radios_nothing_is_lost_without_a_trace(name: str) -> None:
    trace = simulate(_contending(name))
    check(trace)
    sums = balance(trace)
    assert sums.received > 0.99 * sums.created
    assert metrics(trace)["coverage"].value > 0.3


def test_not_waiting_for_a_countdown_that_nothing_can_disturb_changes_nothing(monkeypatch) -> None:
    usual = simulate(_contending("baseline"))
    monkeypatch.setattr(Medium, "undisturbed", False)
    waiting = simulate(_contending("baseline"))
    for one, other in zip(usual.events.columns(), waiting.events.columns(), strict=True):
        np.testing.assert_array_equal(one, other)


def test_the_places_of_a_run_are_known_without_running_it() -> None:
    config = _config("baseline", 6, keep="images", horizon_s=600.0, warmup_s=0.0)
    places = street_of(config)
    joined = simulate(config).events.of(EventKind.JOIN, EventKind.LEAVE)
    joined = joined.where((joined.t_ns > 0) & (joined.t_ns < to_ns(600.0)))
    assert len(joined) > 10
    for node, peer, t_ns in zip(
        joined.node.tolist(), joined.peer.tolist(), joined.t_ns.tolist(), strict=True
    ):
        assert places.distance_m(node, peer, t_ns) == pytest.approx(config.radio.range_m, abs=1e-3)
