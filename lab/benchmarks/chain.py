"""Time and memory of the whole chain on the nodes of a demo scene, with the images in memory."""

from __future__ import annotations

import statistics
import time

from lab.benchmarks.benchmark import Benchmark
from packetmesh.memory import peak_memory_bytes
from pipeline.config import PRESETS
from pipeline.io.demos import load_demo
from pipeline.reconstruct import reconstruct
from pipeline.types import Rig

ROUNDS = 7


def benchmark(nodes: int) -> Benchmark:
    """Reconstruct the first ``nodes`` nodes of the living room, and measure the whole and each stage."""
    rig = load_demo("living-room")
    part = Rig(rig.name, rig.frames[:nodes])
    reconstruct(part, PRESETS["packetmesh"])  # loads and compiles what is only done at first use
    seconds, stages = [], []
    for _ in range(ROUNDS):
        started = time.perf_counter()
        stages.append(reconstruct(part, PRESETS["packetmesh"]).timings_s)
        seconds.append(time.perf_counter() - started)
    medians_s = {stage: statistics.median(run[stage] for run in stages) for stage in stages[0]}
    rows = tuple({"stage": stage, "elapsed_s": elapsed_s} for stage, elapsed_s in medians_s.items())
    notes = tuple(f"{stage:<10} {elapsed_s:.3f} s" for stage, elapsed_s in medians_s.items())
    return Benchmark(statistics.median(seconds), {}, peak_memory_bytes(), runs=rows, notes=notes)
