"""Speed of the simulator: the whole study of SPEC 6.2, on every core."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import asdict

from network_sim.batch import run_batch
from network_sim.experiments.study import RUNS, SCHEMES, STREET, Case
from network_sim.experiments.tasks import TimedRun, timed_run
from network_sim.replicate import replications
from pipeline.experiments.benchmark import Benchmark

OBJECTS = 60


def network(objects: int = OBJECTS, horizon_s: float = STREET.run.horizon_s, runs: int = RUNS) -> Benchmark:
    """Every scheme with ``objects`` vehicles: five runs of five hours each.

    The time is that of all of them, the start of the processes included; the memory that of the process which
    held most.
    """
    tasks = [run for scheme in SCHEMES for run in replications(Case(scheme, objects).config(horizon_s), runs)]
    started = time.perf_counter()
    timed: list[TimedRun] = [run for _, run in run_batch(timed_run, tasks)]
    elapsed_s = time.perf_counter() - started
    total = {
        "scheme": "all",
        "elapsed_s": elapsed_s,
        "simulated_s_per_s": sum(run.simulated_s for run in timed) / elapsed_s,
        "events_per_s": sum(run.events for run in timed) / elapsed_s,
    }
    timed.sort(key=lambda run: (SCHEMES.index(run.scheme), run.seed))
    return Benchmark(
        elapsed_s,
        {},
        max(run.peak_memory_bytes for run in timed),
        runs=(total, *(asdict(run) for run in timed)),
    )


CASES: dict[str, Callable[[], Benchmark]] = {"network": network}
