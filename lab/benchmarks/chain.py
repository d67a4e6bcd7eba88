"""The whole chain on the nodes of a demo scene, images in memory."""

from __future__ import annotations

import statistics
import time

from lab.benchmarks.benchmark import Benchmark
from packetmesh.memory import peak_memory_bytes
from pipeline.config import PRESETS
from pipeline.io.demos import load_demo
from pipeline.reconstruct import reconstruct
from pipeline.types import Rig

ROUNDS = 3


def benchmark(nodes: int) -> Benchmark:
    """Reconstruct the first ``nodes`` nodes of the living room."""
    rig = load_demo("living-room")
    part = Rig(rig.name, rig.frames[:nodes])
    seconds = []
    for _ in range(ROUNDS):
        started = time.perf_counter()
        reconstruct(part, PRESETS["packetmesh"])
        seconds.append(time.perf_counter() - started)
    return Benchmark(statistics.median(seconds), {}, peak_memory_bytes())
