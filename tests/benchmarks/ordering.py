"""``python -m tests.benchmarks.ordering``: our order of whole numbers beside NumPy's."""

from __future__ import annotations

import statistics
import time

import numpy as np

from pipeline.kernels.ordering import stable_order

ROUNDS = 15
POINTS = 300_000
SHUFFLED = 2_000
"""Rows are about so far from their places, as points of an image are from those of a grid."""


def main() -> None:
    """Print the median milliseconds of both, for keys of one, two and four digits."""
    rng = np.random.default_rng(0)
    print(f"{'keys up to':>12} {'argsort':>9} {'ours':>9}")
    for bits in (11, 22, 40):
        keys = np.sort(rng.integers(0, 1 << bits, POINTS))
        keys = keys[np.argsort(np.arange(POINTS) + rng.normal(0.0, SHUFFLED, POINTS))]
        ours_ms, peer_ms = [], []
        for _ in range(ROUNDS):
            for take, times_ms in ((np.argsort, peer_ms), (stable_order, ours_ms)):
                started = time.perf_counter()
                take(keys)
                times_ms.append(1e3 * (time.perf_counter() - started))
        print(f"{f'2^{bits}':>12} {statistics.median(peer_ms):6.1f} ms {statistics.median(ours_ms):6.1f} ms")


if __name__ == "__main__":
    main()
