"""``packetmesh bench``: speed and memory beside peers."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from app.cli.text import print_json, say

if TYPE_CHECKING:
    from lab.benchmarks.benchmark import Benchmark


def bench(out: Path, only: tuple[str, ...] = (), load_s: float = 60.0, json: bool = False) -> None:
    """Measure speed and memory beside peers, in one run.

    Args:
        out: Folder for bench.json.
        only: Cases to run; all without it.
        load_s: How long the thirty browsers of the cases `load` and `soak` stay, in seconds.
        json: Print the results as one JSON object.
    """
    from lab.benchmarks import CASES, run_benchmarks
    from packetmesh.files import writable_folder, write_json

    writable_folder(out)
    served = {kind: partial(_browsers, kind, load_s) for kind in ("load", "soak")}
    results = {}
    for case, result in run_benchmarks(only, CASES | served):
        peers = ", ".join(f"{name} {seconds:.3f} s" for name, seconds in result.peers.items()) or "no peer"
        say(f"{case}: {result.ours_s:.3f} s ({peers}), {result.peak_memory_bytes / 1e6:.0f} MB at most")
        for note in result.notes:
            say(f"  {note}")
        results[case] = result.record()
    write_json(out / "bench.json", results)
    if json:
        print_json(results)


def _browsers(kind: Literal["load", "soak"], seconds: float) -> Benchmark:
    """Thirty browsers at once; the time is the median from a click to its answer."""
    from app.load.load import put_load, soak
    from lab.benchmarks.benchmark import Benchmark

    load = put_load(seconds) if kind == "load" else soak(seconds)
    record = load.record()
    return Benchmark(
        record["answers_s"]["median"],
        {},
        record["server_peak_bytes"] + record["workers_peak_bytes"],
        runs=(record,),
        notes=load.notes(),
    )
