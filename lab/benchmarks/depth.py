"""The shipped depth network: time, size, error due to its 8 bits, and hole filling compared with peers."""

from __future__ import annotations

import statistics
import time
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass

from lab.benchmarks.benchmark import Benchmark
from lab.benchmarks.filling import OURS, Filling, fillings
from packetmesh.memory import peak_memory_bytes
from pipeline.depth import DepthNetwork
from pipeline.io.demos import load_demo
from pipeline.types import ByteArray

ROUNDS = 50
WARM_UP = 5


@dataclass(frozen=True, slots=True)
class NetworkSpeed:
    """Speed of the shipped network on one image, its size, and errors stored in its file."""

    elapsed_s: float
    """Median for a frame of 640 x 480, including its resizing."""
    slowest_s: float
    rounds: int
    provider: str
    """Execution provider of onnxruntime that ran it."""
    file_bytes: int
    abs_rel: float | None
    """AbsRel of the quantised network on validation rooms, from the file's metadata; None without it."""
    quantisation_cost: float | None
    """AbsRel that quantisation added to that of the float network, from the metadata; None without it."""


def benchmark() -> Benchmark:
    """Measure the shipped network, and the filling of hidden holes by us and by the usual peers.

    The times are those of filling one frame. The errors are medians over the hidden pixels. Both are of the
    real frames, or of the demo scenes if there are no real frames.
    """
    network = DepthNetwork()
    speed = network_speed(network, load_demo("living-room").frames[0].rgb)
    groups = fillings(network)
    last = [run.group for run in groups if run.group.endswith(", hidden")][-1]
    chosen = {run.program: run for run in groups if run.group == last}
    seconds = {name: run.elapsed_s for name, run in chosen.items()}
    errors_m = {name: run.median_error_m for name, run in chosen.items()}
    runs = (asdict(speed), *(asdict(run) for run in groups))
    return Benchmark(
        seconds.pop(OURS),
        seconds,
        peak_memory_bytes(),
        errors_m=errors_m,
        runs=runs,
        notes=tuple(error_lines(groups)),
    )


def error_lines(runs: Sequence[Filling]) -> Iterator[str]:
    """Yield a line per group of holes: every program's relative error over all its pixels, lowest first."""
    for group in dict.fromkeys(run.group for run in runs):
        ranked = sorted((run for run in runs if run.group == group), key=lambda run: run.abs_rel)
        yield f"{group}: {', '.join(f'{run.program} {run.abs_rel:.4f}' for run in ranked)}"


def network_speed(network: DepthNetwork, rgb: ByteArray, rounds: int = ROUNDS) -> NetworkSpeed:
    """Infer one (H, W, 3) image repeatedly, after warm-up."""
    seconds = []
    for _ in range(WARM_UP + rounds):
        started = time.perf_counter()
        network.infer(rgb)
        seconds.append(time.perf_counter() - started)
    seconds = seconds[WARM_UP:]
    abs_rel, float_abs_rel = (
        None if (text := network.description.get(name)) is None else float(text)
        for name in ("abs_rel", "float_abs_rel")
    )
    return NetworkSpeed(
        elapsed_s=statistics.median(seconds),
        slowest_s=max(seconds),
        rounds=rounds,
        provider=network.provider,
        file_bytes=network.model_path.stat().st_size,
        abs_rel=abs_rel,
        quantisation_cost=None if abs_rel is None or float_abs_rel is None else abs_rel - float_abs_rel,
    )
