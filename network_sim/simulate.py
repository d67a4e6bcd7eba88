"""Simulation of one run: config in, trace out, with the conservation of packets checked."""

from __future__ import annotations

from collections.abc import Generator

import numpy as np
import simpy
from simpy.core import StopSimulation

from network_sim.config import NetworkConfig
from network_sim.fixed.collection import Collection, collection_names
from network_sim.street.street import start_street
from network_sim.trace.conservation import check
from network_sim.trace.log import NetworkTrace, Recorder
from network_sim.types import to_ns
from packetmesh.progress import Progress, drain

REPORTS = 100
"""Number of progress reports in a run."""


def simulate(config: NetworkConfig) -> NetworkTrace:
    """Simulate one run of the network; the same config gives the same trace to the byte.

    Args:
        config: topology, radio, medium access, images, and how long the run takes.

    Returns:
        The trace: events with times in nanoseconds, counters, and the nodes' positions in metres.

    Raises:
        InputError: a recorded link cannot be read, the streets have too many cells, or Bluetooth nodes have
            too little time for a packet.
        InternalError: the trace contradicts itself.

    >>> import packetmesh as pm
    >>> config = pm.with_settings(pm.NETWORK_PRESETS["thesis-link"], ["nodes.image_bytes=2000"])
    >>> trace = pm.simulate(config)
    >>> trace.counters.images.arrived, trace.names
    (3, ('node 1', 'node 2', 'node 3', 'sink'))
    """
    return drain(iterate_simulation(config))


def iterate_simulation(config: NetworkConfig) -> Generator[Progress, None, NetworkTrace]:
    """Simulate one run of the network and report progress about a hundred times.

    Args:
        config: topology, radio, medium access, images, and how long the run takes.

    Returns:
        The trace, in which every packet is received, dropped or in flight. The run stops at the horizon, or
        as soon as every image of a collection has arrived or was given up.

    Raises:
        InputError: a recorded link cannot be read, the streets have too many cells, or Bluetooth nodes have
            too little time for a packet.
        InternalError: the trace contradicts itself.

    >>> import packetmesh as pm
    >>> config = pm.with_settings(pm.NETWORK_PRESETS["thesis-link"], ["nodes.image_bytes=2000"])
    >>> fractions = [progress.fraction for progress in pm.iterate_simulation(config)]
    >>> fractions == sorted(fractions) and fractions[-1] == 1.0
    True
    """
    env, rng = simpy.Environment(), np.random.default_rng(config.run.seed)
    run = _collect if config.scenario == "collection" else _drive
    trace = yield from run(env, config, rng)
    check(trace)
    return trace


def _collect(
    env: simpy.Environment, config: NetworkConfig, rng: np.random.Generator
) -> Generator[Progress, None, NetworkTrace]:
    recorder = _recorder(config, len(collection_names(config)))
    network = Collection(env, config, recorder, rng)
    assert network.ended.callbacks is not None
    network.ended.callbacks.append(StopSimulation.callback)
    for share in _run(env, config):
        yield Progress("collection", max(share, network.fraction))
        if network.ended.triggered:
            break
    return recorder.trace(config, network.names, network.positions_m, int(env.now), network.roles)


def _drive(
    env: simpy.Environment, config: NetworkConfig, rng: np.random.Generator
) -> Generator[Progress, None, NetworkTrace]:
    recorder = _recorder(config, config.street.vehicles + config.street.access_points)
    street = start_street(env, config, recorder, rng)
    for share in _run(env, config):
        yield Progress("street grid", share)
    street.record_images()
    return recorder.trace(config, street.names, None, int(env.now), street.roles)


def _recorder(config: NetworkConfig, nodes: int) -> Recorder:
    return Recorder(config.run.keep, nodes, to_ns(config.run.warmup_s))


def _run(env: simpy.Environment, config: NetworkConfig) -> Generator[float, None, None]:
    """Run to the horizon in ``REPORTS`` steps; yields the share of the run that is done."""
    horizon_ns = to_ns(config.run.horizon_s)
    for step in range(1, REPORTS + 1):
        until_ns = horizon_ns * step // REPORTS
        if until_ns > env.now:
            env.run(until=until_ns)
        yield step / REPORTS
