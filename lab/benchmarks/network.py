"""Speed of the simulator: the study of SPEC 6.2 on all cores, and saturated nodes compared with ns-3."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

from lab.benchmarks.benchmark import Benchmark
from lab.benchmarks.ns3 import Counts, Row, Run, Theirs, compare, find_python, run_ns3
from lab.claims.network.study import RUNS, SCHEMES, STREET, Case
from lab.claims.network.tasks import TimedRun, timed_run
from network_sim.config import MacKind
from network_sim.replicate import replications
from network_sim.settings.street import SchemeName
from packetmesh.batch import run_batch
from packetmesh.errors import PacketMeshError

OBJECTS = 60
LONGEST_FIRST: tuple[SchemeName, ...] = ("baseline", "pdc", "greedy")
"""Schemes from the longest run to the shortest, so that all cores finish at about the same time."""
SATURATED: Counts = {"ieee802154": (1, 2, 5, 20, 50), "ieee80211b": (1, 5, 20, 50)}
SATURATED_S: dict[MacKind, float] = {"ieee802154": 60.0, "ieee80211b": 10.0}
"""Simulated seconds. IEEE 802.15.4 has few events in a second, so its runs are longer: compared with them,
the set-up of a run, which only our clock includes, must be short."""


def benchmark(
    objects: int = OBJECTS,
    horizon_s: float = STREET.run.horizon_s,
    runs: int = RUNS,
    saturated_s: Mapping[MacKind, float] = SATURATED_S,
) -> Benchmark:
    """Measure ``runs`` runs of ``horizon_s`` of every scheme with ``objects`` vehicles, and saturated nodes.

    The time is that of the study, including the start of the processes; the memory is that of its largest
    process. ns-3 has no such study, so it is a peer of the saturated nodes only.
    """
    tasks = [
        run for scheme in LONGEST_FIRST for run in replications(Case(scheme, objects).config(horizon_s), runs)
    ]
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
    rows, missing = [], set()
    for mac, nodes in SATURATED.items():
        theirs: Theirs = {}
        try:
            theirs, _ = run_ns3(find_python(), {mac: nodes}, saturated_s[mac])
        except PacketMeshError as error:
            missing.add(str(error))
        rows += compare({mac: nodes}, theirs, saturated_s[mac])
    return Benchmark(
        elapsed_s,
        {},
        max(run.peak_memory_bytes for run in timed),
        runs=(total, *(asdict(run) for run in timed), *map(_record, rows)),
        notes=(
            f"study: {total['simulated_s_per_s']:,.0f} simulated s and {total['events_per_s']:,.0f} lines of "
            "the trace in a second",
            *map(_note, rows),
            *missing,
        ),
    )


def _record(row: Row) -> dict[str, Any]:
    """Return rates of both programs, and our wall time and throughput over ns-3's; None without ns-3."""
    return {
        "mac": row.mac,
        "nodes": row.nodes,
        "network_sim": _rates(row.network_sim),
        "ns3": row.ns3 and _rates(row.ns3),
        "time_ratio": row.time_ratio,
        "throughput_ratio": row.ratio,
        "verdict": row.verdict,
    }


def _rates(run: Run) -> dict[str, float]:
    return {"simulated_s_per_s": run.simulated_s_per_s, "kernel_events_per_s": run.events_per_s}


def _note(row: Row) -> str:
    text = f"{row.mac}, {row.nodes} saturated: {_rates_text(row.network_sim)}"
    if row.ns3:
        text += (
            f"; ns-3: {_rates_text(row.ns3)}; wall time {row.time_ratio:.2f} and "
            f"throughput {row.ratio:.3f} of ns-3's ({row.verdict})"
        )
    return text


def _rates_text(run: Run) -> str:
    return f"{run.simulated_s_per_s:,.1f} simulated s and {run.events_per_s:,.0f} kernel events in a second"
