"""Time and size of the shipped network against their budgets, and what its 8 bits cost."""

from __future__ import annotations

import statistics
import time
from dataclasses import dataclass

from pipeline.depth import DepthNetwork
from pipeline.types import ByteArray

ROUNDS = 50
WARM_UP = 5
BUDGET_S = 0.050
BUDGET_BYTES = 40_000_000
BUDGET_COST = 0.01


@dataclass(frozen=True, slots=True)
class NetworkSpeed:
    """The shipped network on one image."""

    elapsed_s: float
    """Median for a frame of 640 x 480, its resizing included."""
    slowest_s: float
    rounds: int
    provider: str
    """What really ran it."""
    file_bytes: int
    abs_rel: float | None
    """From the file's metadata: AbsRel of the quantised network on held-out rooms."""
    quantisation_cost: float | None
    """AbsRel that quantisation added to the float network's, from the metadata; None without them."""
    within_time: bool
    """At most 50 ms."""
    within_size: bool
    """At most 40 MB."""
    within_cost: bool
    """At most 0.01; False if the file does not record it."""


def network_speed(network: DepthNetwork, rgb: ByteArray, rounds: int = ROUNDS) -> NetworkSpeed:
    """Infer one (H, W, 3) image over and over, warm."""
    seconds = []
    for _ in range(WARM_UP + rounds):
        started = time.perf_counter()
        network.infer(rgb)
        seconds.append(time.perf_counter() - started)
    seconds = seconds[WARM_UP:]
    abs_rel, float_abs_rel = (number(network.description.get(name)) for name in ("abs_rel", "float_abs_rel"))
    cost = None if abs_rel is None or float_abs_rel is None else abs_rel - float_abs_rel
    elapsed_s, file_bytes = statistics.median(seconds), network.model_path.stat().st_size
    return NetworkSpeed(
        elapsed_s,
        max(seconds),
        rounds,
        network.provider,
        file_bytes,
        abs_rel,
        cost,
        elapsed_s <= BUDGET_S,
        file_bytes <= BUDGET_BYTES,
        cost is not None and cost <= BUDGET_COST,
    )


def number(text: str | None) -> float | None:
    """A number in a file's metadata; None where it has none."""
    return None if text is None else float(text)
