"""Metrics of a run: pure functions of its trace, each number with its unit and its definition.

Most metrics come from the counters and so do not depend on whether the log was kept. A metric whose data are
missing is absent. Events of the warm-up do not count, nor do packets and images created in it.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from network_sim.metrics import energy
from network_sim.metrics.coverage import NEVER_NS, RoadCoverage, piece_coverage, road_coverage
from network_sim.trace.ledger import Outcomes
from network_sim.trace.log import NetworkTrace
from network_sim.trace.states import State
from network_sim.types import NS_PER_S, Cause, EventKind, PacketKind, to_ns, to_s
from packetmesh.errors import InputError


@dataclass(frozen=True, slots=True)
class Metric:
    """A number with its unit and definition."""

    value: float
    unit: str
    """ "1" for a share or a count."""
    definition: str


Rows = Iterator[tuple[str, float, str, str]]


def metrics(trace: NetworkTrace) -> dict[str, Metric]:
    """Compute all metrics that the trace allows, by name; none if the run ended within the warm-up.

    >>> import packetmesh as pm
    >>> config = pm.with_settings(pm.NETWORK_PRESETS["thesis-link"], ["nodes.image_bytes=2000"])
    >>> pm.network_metrics(pm.simulate(config))["image_delivery_ratio"].value
    1.0
    """
    if trace.horizon_ns <= to_ns(trace.config.run.warmup_s):
        return {}
    groups = (_outcomes, _rates, _losses, _airtime, _queue, _energy, _overheads, _coverage)
    return {
        name: Metric(float(value), unit, definition)
        for group in groups
        for name, value, unit, definition in group(trace)
        if np.isfinite(value)
    }


def image_delays_s(trace: NetworkTrace) -> NDArray[np.float64]:
    """Return (A,) seconds from capture to arrival of each image that arrived, in the order of arrival.

    As in the metrics, images that were captured during the warm-up do not count.

    Raises:
        InputError: the run kept no events.

    >>> import packetmesh as pm
    >>> config = pm.with_settings(pm.NETWORK_PRESETS["thesis-link"], ["nodes.image_bytes=2000"])
    >>> delays_s = pm.image_delays_s(pm.simulate(config))
    >>> len(delays_s), bool((delays_s > 0.0).all())
    (3, True)
    """
    if trace.config.run.keep == "counters":
        raise InputError("The run kept counters only, not its images' delays; try run.keep=images")
    captured, arrived = trace.events.of(EventKind.CAPTURE), trace.events.of(EventKind.ARRIVE)
    by_image = np.argsort(captured.image)
    of_arrived = by_image[np.searchsorted(captured.image, arrived.image, sorter=by_image)]
    captured_ns = captured.t_ns[of_arrived]
    counts = captured_ns >= to_ns(trace.config.run.warmup_s)
    return (arrived.t_ns - captured_ns)[counts] / NS_PER_S


def elapsed_s(trace: NetworkTrace) -> float:
    """Return the seconds from the end of the warm-up to the end of the run."""
    return to_s(trace.horizon_ns - to_ns(trace.config.run.warmup_s))


def _outcomes(trace: NetworkTrace) -> Rows:
    """Yield delivery ratios and delays of images and of their packets."""
    yield from _outcome("image", trace.counters.images, "taken", "from capture")
    yield from _outcome("packet", trace.counters.packets, "queued", "from entering the first buffer")


def _outcome(noun: str, outcomes: Outcomes, began: str, since: str) -> Rows:
    if outcomes.created:
        share = outcomes.arrived / outcomes.created
        still = "those still on their way at the end count as not arrived"
        yield f"{noun}_delivery_ratio", share, "1", f"Share of the {noun}s {began} that arrived; {still}"
    delays = outcomes.delays
    took = f"time {since} to arrival, of the {noun}s that arrived"
    yield f"{noun}_delay_mean", delays.mean_s, "s", f"Mean {took}"
    yield f"{noun}_delay_deviation", delays.deviation_s, "s", f"Standard deviation of the {took}"
    for name, percent, what in (("median", 50.0, "Median"), ("p95", 95.0, "95th percentile of the")):
        yield f"{noun}_delay_{name}", delays.percentile_s(percent), "s", f"{what} {took}, exact to 1.2 %"


def _rates(trace: NetworkTrace) -> Rows:
    time_s = elapsed_s(trace)
    goodput_bps = 8 * _bytes(trace, EventKind.ARRIVE) / time_s
    throughput_bps = 8 * _bytes(trace, EventKind.RECEIVE, PacketKind.IMAGE) / time_s
    yield "goodput", goodput_bps, "bit/s", "Bits of complete images at their destination, over time"
    yield "throughput", throughput_bps, "bit/s", "Bits of image packets at their last node, over time"
    taken, arrived = (60 * _count(trace, kind) / time_s for kind in (EventKind.CAPTURE, EventKind.ARRIVE))
    yield "images_taken_per_minute", taken, "1/min", "Images that cameras took"
    yield "images_per_minute", arrived, "1/min", "Images that arrived complete"


def _losses(trace: NetworkTrace) -> Rows:
    """Yield numbers of failed attempts, packets and images by cause; zeros too, for averages over runs."""
    delivered = _count(trace, EventKind.DELIVER)
    for kind, name, what in (
        (EventKind.LOSS, "attempts_lost", "Failed attempts to send a packet, retries included"),
        (EventKind.DROP, "packets_dropped", "Packets that were given up"),
        (EventKind.EXPIRE, "images_expired", "Images that cameras gave up or dropped from a full buffer"),
    ):
        yield name, _count(trace, kind), "1", f"{what}, for any cause"
        counts = _after(trace, trace.counters.count)[:, kind].sum(axis=(0, 1))
        for cause in tuple(Cause)[1:]:
            words = cause.name.lower()
            yield f"{name}_{words}", counts[cause], "1", f"{what}, cause: {words.replace('_', ' ')}"
        if kind == EventKind.LOSS and delivered:
            ratio = counts[Cause.COLLISION] / delivered
            yield "collisions_per_delivery", ratio, "1", "Attempts lost to collisions, per packet and hop"


def _airtime(trace: NetworkTrace) -> Rows:
    sending_s = _states_ns(trace)[:, State.SENDING] / NS_PER_S
    share = "acknowledgements included, over time; far nodes that send at once can make it exceed 1"
    yield "airtime_share", sending_s.sum() / elapsed_s(trace), "1", f"Time on the air of all frames, {share}"
    yield "frames", _count(trace, EventKind.AIR), "1", "Frames sent, retries included, replies not"


def _queue(trace: NetworkTrace) -> Rows:
    """Yield the mean queue: a packet adds its time from entering to the run's end, less that from leaving."""
    counters = trace.counters
    rest_ns = trace.horizon_ns - counters.edges_ns[1:, None, None, None]
    weights_s = (counters.until_end_ns + counters.count * rest_ns) / NS_PER_S
    weights_s[: counters.warmup_minutes] = counters.count[: counters.warmup_minutes] * elapsed_s(trace)
    came, went, dropped = (
        weights_s[:, kind].sum() for kind in (EventKind.ENQUEUE, EventKind.DELIVER, EventKind.DROP)
    )
    mean = (came - went - dropped) / elapsed_s(trace)
    yield "queue", mean, "1", "Packets in all buffers together, those being sent included, averaged over time"


def _energy(trace: NetworkTrace) -> Rows:
    cameras = camera_nodes(trace)
    if not cameras.any():
        return
    times = energy.radio_times(_states_ns(trace)[cameras], elapsed_s(trace))
    spent = energy.joules(times, trace.config.energy)
    for name, joules, what in (
        ("radio_sending", spent.tx_j, "radios that send"),
        ("radio_receiving", spent.rx_j, "radios that receive what is addressed to them"),
        ("radio_listening", spent.idle_j, "radios that listen"),
        ("radio_sleeping", spent.sleep_j, "radios that sleep or have failed"),
        ("radio", spent.radio_j, "radios in all states"),
        ("platform_awake", spent.platform_j, "computers and cameras that are awake"),
        ("platform_sleeping", spent.platform_sleep_j, "computers and cameras that sleep or have failed"),
        ("total", spent.total_j, "radios, computers and cameras"),
    ):
        yield f"energy_{name}", joules.sum(), "J", f"Energy of {what}, all camera nodes together"
    total_j = spent.total_j
    yield "energy_per_node", total_j.mean(), "J", "Energy of a camera node, their mean"
    if arrived := _count(trace, EventKind.ARRIVE):
        yield "energy_per_image", total_j.sum() / arrived, "J", "Energy of all camera nodes per arrived image"
    least_s = energy.lifetimes_s(times, trace.config.energy).min()
    until = "Time until the first camera node's battery is empty, at the mean power of this run"
    yield "lifetime", least_s, "s", until


def _overheads(trace: NetworkTrace) -> Rows:
    for kind in (PacketKind.SUMMARY, PacketKind.REQUEST, PacketKind.STATUS):
        words = kind.name.lower()
        per_minute = 60 * _bytes(trace, EventKind.ENQUEUE, kind) / elapsed_s(trace)
        yield f"{words}_bytes", per_minute, "B/min", f"Bytes of {words} packets queued, at every hop"


def _coverage(trace: NetworkTrace) -> Rows:
    """Yield road coverage, by cells and by pieces, and redundancy, if images of road cells were kept."""
    scheme = trace.config.scheme
    span = f"span of {scheme.validity_s:g} s"
    if sights := road_coverage(trace):
        pairs = f"Pairs of a road cell and a {span} of which an image arrived"
        yield "coverage", _covered(sights) / len(sights.cell), "1", f"{pairs}, of all that cameras saw"
        if sights.arrived:
            again = f"Share of the arrived images whose road cell and {span} are those of an earlier arrival"
            yield "redundancy", 1.0 - _covered(sights) / sights.arrived, "1", again
    if sights := piece_coverage(trace):
        road = f"{scheme.cell_m / scheme.pieces:g} m of road"
        pairs = f"Pairs of {road} and a {span} of which an image, or its piece of them, arrived"
        yield "coverage_pieces", _covered(sights) / len(sights.cell), "1", f"{pairs}, of all that cameras saw"


def _covered(sights: RoadCoverage) -> int:
    return int((sights.covered_ns != NEVER_NS).sum())


def _after(trace: NetworkTrace, sums: NDArray[np.int64]) -> NDArray[np.int64]:
    return sums[trace.counters.warmup_minutes :]


def _count(trace: NetworkTrace, kind: EventKind) -> int:
    return int(_after(trace, trace.counters.count)[:, kind].sum())


def _bytes(trace: NetworkTrace, kind: EventKind, packet_kind: PacketKind | None = None) -> int:
    sums = _after(trace, trace.counters.size_bytes)[:, kind]
    return int(sums.sum() if packet_kind is None else sums[:, packet_kind].sum())


def _states_ns(trace: NetworkTrace) -> NDArray[np.int64]:
    """Return (N, S) nanoseconds in each state after the warm-up."""
    return _after(trace, trace.counters.states_ns).sum(axis=0)


def camera_nodes(trace: NetworkTrace) -> NDArray[np.bool_]:
    """Return (N,) True for nodes with camera and battery; sinks, access points and cloud have mains power."""
    return np.isin(trace.roles, ("node", "vehicle"))
