"""Speed and memory, each case in a fresh process so that its peak memory is its own."""

from __future__ import annotations

import multiprocessing
import statistics
import time
from collections.abc import Callable, Iterable, Iterator
from dataclasses import asdict, dataclass
from typing import Any

from pipeline.errors import InputError

ROUNDS = 3


@dataclass(frozen=True, slots=True)
class Benchmark:
    """One case measured, beside its peers in the same run."""

    ours_s: float
    """Median of the rounds, seconds."""
    peers: dict[str, float]
    """Median seconds of other programs on the same input."""
    peak_memory_bytes: int
    """Most memory of the measuring process, its libraries included."""

    def record(self) -> dict[str, Any]:
        """Plain values; ``ratio`` is our time over the fastest peer's."""
        ratio = self.ours_s / min(self.peers.values()) if self.peers else None
        return asdict(self) | {"ratio": ratio}


def _chain(nodes: int) -> Callable[[], None]:
    """Reconstruct the first ``nodes`` nodes of the living room, images in memory."""
    from pipeline.config import PRESETS
    from pipeline.reconstruct import reconstruct
    from pipeline.scenes import load_demo
    from pipeline.types import Rig

    rig = load_demo("living-room")
    part = Rig(rig.name, rig.frames[:nodes])
    return lambda: _ignore(reconstruct(part, PRESETS["packetmesh"]))


def _ignore(_: object) -> None:
    return None


CASES: dict[str, tuple[Callable[[int], Callable[[], None]], int]] = {
    "reconstruct one 640x480 pair": (_chain, 1),
    "reconstruct a rig of three": (_chain, 3),
}


def run_benchmarks(only: Iterable[str] = ()) -> Iterator[tuple[str, Benchmark]]:
    """Measure the cases named, or all.

    Raises:
        InputError: a name is not a case.
    """
    wanted = list(only) or list(CASES)
    unknown = [name for name in wanted if name not in CASES]
    if unknown:
        raise InputError(f"There is no benchmark '{unknown[0]}'; known are {', '.join(CASES)}")
    context = multiprocessing.get_context("spawn")
    for name in wanted:
        with context.Pool(1) as process:
            yield name, process.apply(_measure, (name,))


def _measure(name: str) -> Benchmark:
    from pipeline.run_folder import peak_memory_bytes

    prepare, argument = CASES[name]
    run = prepare(argument)
    seconds = []
    for _ in range(ROUNDS):
        started = time.perf_counter()
        run()
        seconds.append(time.perf_counter() - started)
    return Benchmark(statistics.median(seconds), {}, peak_memory_bytes())
