"""The job of the Network screen: a delivery of the rig's images, or runs of other networks."""

from __future__ import annotations

import time
from collections.abc import Generator
from functools import partial
from typing import Any

from app.compute.state import Spec
from app.compute.store import Store
from app.screens.network.delivery_job import delivery_job
from app.screens.network.run_view import run_view
from app.screens.network.view import NetworkView
from network_sim.config import NetworkConfig
from network_sim.simulate import iterate_simulation
from packetmesh.progress import Progress, part


def network_job(store: Store, spec: Spec) -> Generator[Any, None, Any]:
    """Return a ``DeliveryView``, yielding partial ones before, or the ``NetworkView`` of every run."""
    if spec.sent is not None:
        return (yield from delivery_job(store, spec))
    return (yield from runs_job(store, spec))


def runs_job(store: Store, spec: Spec) -> Generator[Progress, None, tuple[NetworkView, ...]]:
    """Simulate all runs of the spec one after the other and return their views."""
    views, share = [], 1.0 / max(1, len(spec.networks))
    for index, config in enumerate(spec.networks):
        work = store.remember(("simulate", config), partial(_simulated, config))
        stage = f"simulating run {index + 1} of {len(spec.networks)}"
        views.append((yield from part(work, stage, index * share, (index + 1) * share)))
    return tuple(views)


def _simulated(config: NetworkConfig) -> Generator[Progress, None, NetworkView]:
    started = time.perf_counter()
    trace = yield from iterate_simulation(config)
    return run_view(trace, time.perf_counter() - started)
