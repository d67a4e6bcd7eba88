"""Speed and memory beside peers, in one run; each case in a fresh process, so that its memory is its own."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable, Iterable, Iterator
from dataclasses import asdict
from functools import partial

from lab.benchmarks.benchmark import Benchmark, run_alone
from packetmesh.errors import InputError

ROUNDS = 3


def _chain(nodes: int) -> Benchmark:
    """Reconstruct the first ``nodes`` nodes of the living room, images in memory."""
    from packetmesh.memory import peak_memory_bytes
    from pipeline.config import PRESETS
    from pipeline.io.demos import load_demo
    from pipeline.reconstruct import reconstruct
    from pipeline.types import Rig

    rig = load_demo("living-room")
    part = Rig(rig.name, rig.frames[:nodes])
    seconds = []
    for _ in range(ROUNDS):
        started = time.perf_counter()
        reconstruct(part, PRESETS["packetmesh"])
        seconds.append(time.perf_counter() - started)
    return Benchmark(statistics.median(seconds), {}, peak_memory_bytes())


def _registration(peers_thinned: bool) -> Benchmark:
    """100,000 points on 100,000 points; each program's memory is that of a process of its own."""
    from lab.benchmarks.registration import OURS, measure_speed

    result = measure_speed(peers_thinned)
    peers_s, memory = dict(result.elapsed_s), dict(result.peak_memory_bytes)
    return Benchmark(peers_s.pop(OURS), peers_s, memory.pop(OURS), memory, result.point_error_m)


def _surface() -> Benchmark:
    """Ball pivoting of about 50,000 points; the times are those of all four balls together."""
    from lab.benchmarks.surface import HEADLINE, OURS, ROOM, measure_speed

    runs = tuple(measure_speed())
    chosen = {run.program: run for run in runs if run.cloud == ROOM and run.balls == HEADLINE}
    ours = chosen.pop(OURS)
    return Benchmark(
        ours.elapsed_s,
        {name: run.elapsed_s for name, run in chosen.items()},
        ours.peak_memory_bytes,
        {name: run.peak_memory_bytes for name, run in chosen.items()},
        runs=tuple(asdict(run) for run in runs),
    )


def _depth() -> Benchmark:
    """The shipped network against its budgets, and hidden holes filled by us and by the obvious peers.

    The times are those of filling one frame, the errors medians in the real frames' hidden pixels, or in
    the demo scenes' where there are no real frames.
    """
    from lab.benchmarks.depth_network import network_speed
    from lab.benchmarks.filling import OURS, fillings
    from packetmesh.memory import peak_memory_bytes
    from pipeline.depth import DepthNetwork
    from pipeline.io.demos import load_demo

    network = DepthNetwork()
    speed = network_speed(network, load_demo("living-room").frames[0].rgb)
    groups = fillings(network)
    chosen = {run.program: run for run in groups if run.group == groups[-1].group}
    seconds = {name: run.elapsed_s for name, run in chosen.items()}
    errors_m = {name: run.median_error_m for name, run in chosen.items()}
    runs = (asdict(speed), *(asdict(run) for run in groups))
    return Benchmark(seconds.pop(OURS), seconds, peak_memory_bytes(), errors_m=errors_m, runs=runs)


def _network() -> Benchmark:
    """The whole study of SPEC 6.2 on every core, and saturated nodes beside ns-3's."""
    from lab.benchmarks.network import network

    return network()


CASES: dict[str, Callable[[], Benchmark]] = {
    "reconstruct one 640x480 pair": partial(_chain, 1),
    "reconstruct a rig of three": partial(_chain, 3),
    "registration": partial(_registration, peers_thinned=False),
    "registration, peers thinned like ours": partial(_registration, peers_thinned=True),
    "surface": _surface,
    "depth": _depth,
    "network": _network,
}


def run_benchmarks(only: Iterable[str] = ()) -> Iterator[tuple[str, Benchmark]]:
    """Measure the cases named, or all, one after the other.

    Raises:
        InputError: a name is not a case.
    """
    wanted = list(only) or list(CASES)
    unknown = [name for name in wanted if name not in CASES]
    if unknown:
        raise InputError(f"There is no benchmark '{unknown[0]}'; known are {', '.join(CASES)}")
    for name in wanted:
        yield name, run_alone(CASES[name])
