"""The result of a benchmark case, and a separate process to measure it in."""

from __future__ import annotations

import multiprocessing
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass, field
from typing import Any, TypeVar

import psutil

Answer = TypeVar("Answer")


@dataclass(frozen=True, slots=True)
class Benchmark:
    """One measured case, with its peers in the same run."""

    ours_s: float
    """Time of PacketMesh, seconds; the median if the case has rounds."""
    peers: dict[str, float]
    """Median seconds of the other programs on the same input, by name; empty without peers."""
    peak_memory_bytes: int | None
    """Peak memory of the measuring process (ours, if each program has its own), including its libraries; None
    if that process may only have read stored answers, or has run other programs, too."""
    peer_memory_bytes: dict[str, int] = field(default_factory=dict)
    """Peak memory of each peer, if each program has its own process."""
    errors_m: dict[str, float] = field(default_factory=dict)
    """Error of each program's answer, ours and the peers', metres; empty if the truth is not known."""
    runs: tuple[dict[str, Any], ...] = ()
    """Rows of the case's own record, for example one for each round, stage, or program and group."""
    notes: tuple[str, ...] = ()
    """Lines printed below the times."""

    def record(self) -> dict[str, Any]:
        """Return plain values, with our time over each peer's (``ratios``) and the fastest's (``ratio``).

        Without peers ``ratio`` is None.
        """
        ratios = {name: self.ours_s / peer_s for name, peer_s in self.peers.items()}
        return asdict(self) | {"ratio": max(ratios.values(), default=None), "ratios": ratios}


def run_alone(function: Callable[..., Answer], *arguments: Any, timeout_s: float | None = None) -> Answer:
    """Run a function in a fresh process that does nothing else, and return its result.

    Raises:
        TimeoutError: it took longer than ``timeout_s``; all child processes of this process are then killed.
        BrokenProcessPool: its process ended before it returned.
    """
    with ProcessPoolExecutor(1, mp_context=multiprocessing.get_context("spawn")) as process:
        work = process.submit(function, *arguments)
        try:
            return work.result(timeout=timeout_s)
        except TimeoutError:
            for child in psutil.Process().children(recursive=True):
                child.kill()
            raise
