"""The trials of the network's claims: single runs, each a function of its config only.

This module imports little, so that the processes of the trials start quickly.
"""

from __future__ import annotations

import time
from dataclasses import dataclass

from network_sim.config import NetworkConfig
from network_sim.mac.saturation import saturation
from network_sim.replicate import measured
from network_sim.simulate import simulate
from network_sim.types import EventKind, to_s
from packetmesh.memory import peak_memory_bytes

Values = dict[str, float | None]
"""Values of a run by name; None for a missing value."""

STREET_METRICS = (
    "images_per_minute",
    "coverage",
    "redundancy",
    "summary_bytes",
    "request_bytes",
    "image_delivery_ratio",
    "image_delay_mean",
    "airtime_share",
    "energy_per_image",
)


@dataclass(frozen=True, slots=True)
class Crowd:
    """Stations that all hear one another and always have a packet for the sink in their middle."""

    config: NetworkConfig
    stations: int
    duration_s: float
    seed: int
    wait_after_loss: bool
    """Whether stations wait for an EIFS after a collision, as in the standard; Bianchi's do not."""


@dataclass(frozen=True, slots=True)
class TimedRun:
    """One run and its cost; rates are per core."""

    scheme: str
    seed: int
    vehicles: int
    elapsed_s: float
    simulated_s: float
    events: int
    """Lines of the trace, stored or only counted."""
    simulated_s_per_s: float
    events_per_s: float
    peak_memory_bytes: int
    """Peak memory of its process so far."""


def transfer(config: NetworkConfig) -> Values:
    """Return ``transfer_s``, when the last image was complete at the sink; None if the run ended before."""
    trace = simulate(config)
    arrived_ns = trace.events.of(EventKind.ARRIVE).t_ns
    complete = len(arrived_ns) == config.nodes.count * config.nodes.images
    return {"transfer_s": to_s(int(arrived_ns.max())) if complete else None}


def saturated(task: Crowd) -> Values:
    """Return the throughput and delivery ratio of saturated stations."""
    got = saturation(task.config, task.stations, task.duration_s, task.seed, task.wait_after_loss)
    return {"throughput_bps": got.throughput_bps, "delivery_ratio": got.delivery_ratio}


def street_values(config: NetworkConfig) -> Values:
    """Return the metrics of one run that the claims use."""
    found = measured(config)
    return {name: found[name].value if name in found else None for name in STREET_METRICS}


def timed_run(config: NetworkConfig) -> TimedRun:
    """Simulate and measure the time."""
    started = time.perf_counter()
    trace = simulate(config)
    elapsed_s = time.perf_counter() - started
    events = int(trace.counters.count.sum())
    return TimedRun(
        scheme=config.scheme.name,
        seed=config.run.seed,
        vehicles=config.street.vehicles,
        elapsed_s=elapsed_s,
        simulated_s=config.run.horizon_s,
        events=events,
        simulated_s_per_s=config.run.horizon_s / elapsed_s,
        events_per_s=events / elapsed_s,
        peak_memory_bytes=peak_memory_bytes(),
    )
