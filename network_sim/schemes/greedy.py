"""GREEDY(k): the collector requests the images that add most coverage.

Our reconstruction (SPEC 6.2) of the centralised scheme of Bruno & Nurchis (arXiv 1311.6013). A request has at
least 1 - 1/e of the coverage of the best request with as many ids (Nemhauser, Wolsey & Fisher 1978); lazy
evaluation is Minoux's (1978): gains only fall, so a gain that is still the largest after it was recomputed is
the largest.
"""

from __future__ import annotations

from heapq import heapify, heappop, heappush

import numpy as np

from network_sim.schemes.coverage import Coverage


def select(coverage: Coverage, cells: list[int], captured_ns: list[int], k: int | None) -> list[int]:
    """Choose the images with the largest gains, and count them as covered.

    Args:
        coverage: What is covered already; the chosen images are added to it.
        cells: (T,) cells of the images offered.
        captured_ns: (T,) when they were taken.
        k: Most images to choose; None does not limit it.

    Returns:
        Positions of the chosen images, by falling gain; the first offered of equal ones comes first. None
        gains less than half a validity.
    """
    least_ns = coverage.validity_ns / 2
    gain_ns = coverage.gain_ns
    gains = map(gain_ns, cells, captured_ns)
    heap = [(-gain, index) for index, gain in enumerate(gains) if gain >= least_ns]
    heapify(heap)
    chosen: list[int] = []
    while heap and (k is None or len(chosen) < k):
        bound, index = heappop(heap)
        gain = gain_ns(cells[index], captured_ns[index])
        if gain == -bound:
            chosen.append(index)
            coverage.add(cells[index], captured_ns[index])
        elif gain >= least_ns:
            heappush(heap, (-gain, index))
    return chosen


class Greedy:
    """Counts requested images as covered until they are reported missing."""

    asks = True

    def __init__(self, validity_ns: int, k: int | None) -> None:
        self.coverage = Coverage(validity_ns)
        self.k = k

    def wanted(self, cells: np.ndarray, captured_ns: np.ndarray, now_ns: int) -> list[int]:
        """Positions of the images to ask for, best first."""
        return select(self.coverage, cells.tolist(), captured_ns.tolist(), self.k)

    def received(self, cell: int, now_ns: int) -> None:
        """It was counted as covered with the request."""

    def missed(self, cell: int, captured_ns: int) -> None:
        """A requested image did not arrive."""
        self.coverage.remove(cell, captured_ns)
