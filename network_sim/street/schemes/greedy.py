"""GREEDY(k): the collector requests the images that add most coverage.

Our reconstruction (SPEC 6.2) of the centralised scheme of Bruno & Nurchis (arXiv 1311.6013). A request has at
least 1 - 1/e of the coverage of the best request with as many ids (Nemhauser, Wolsey & Fisher 1978); lazy
evaluation is Minoux's (1978): gains only fall, so a gain that is still the largest after it was recomputed is
the largest.
"""

from __future__ import annotations

from bisect import bisect_left, bisect_right, insort
from collections import defaultdict
from heapq import heapify, heappop, heappush

import numpy as np

from network_sim.street.schemes.scheme import Scheme


class Coverage:
    """The images of a set by cell, and the gain of one more.

    An image of cell c taken at tau covers c during [tau, tau + T_v). The utility of a set A is F(A) = sum
    over cells of the length of the union of its intervals: monotone and submodular.
    """

    def __init__(self, validity_ns: int) -> None:
        self.validity_ns = validity_ns
        self._taken_ns: defaultdict[int, list[int]] = defaultdict(list)

    def gain_ns(self, cell: int, captured_ns: int) -> int:
        """F(A + a) - F(A). All intervals are equally long, so only the nearest on each side matter."""
        taken = self._taken_ns[cell]
        after = bisect_right(taken, captured_ns)
        start_ns = captured_ns
        end_ns = captured_ns + self.validity_ns
        if after and taken[after - 1] + self.validity_ns > start_ns:
            start_ns = taken[after - 1] + self.validity_ns
        if after < len(taken) and taken[after] < end_ns:
            end_ns = taken[after]
        return end_ns - start_ns if end_ns > start_ns else 0

    def add(self, cell: int, captured_ns: int) -> None:
        """Add an image."""
        insort(self._taken_ns[cell], captured_ns)

    def remove(self, cell: int, captured_ns: int) -> None:
        """Remove an image that did not arrive."""
        taken = self._taken_ns[cell]
        del taken[bisect_left(taken, captured_ns)]


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


class Greedy(Scheme):
    """Counts requested images as covered until they are reported missing."""

    def __init__(self, validity_ns: int, k: int | None) -> None:
        self.coverage = Coverage(validity_ns)
        self.k = k

    def wanted(self, cells: np.ndarray, captured_ns: np.ndarray, now_ns: int) -> list[int]:
        """Positions of the images to ask for, best first."""
        return select(self.coverage, cells.tolist(), captured_ns.tolist(), self.k)

    def missed(self, cell: int, captured_ns: int) -> None:
        """A requested image did not arrive."""
        self.coverage.remove(cell, captured_ns)
