"""GREEDY(k): the collector requests the images that add most coverage.

This is our reconstruction (SPEC 6.2) of the centralised scheme of Bruno & Nurchis (arXiv 1311.6013). A
request has at least 1 - 1/e of the coverage of the best request with as many ids (Nemhauser, Wolsey & Fisher
1978). Gains are evaluated lazily (Minoux 1978): they never grow, so a gain that is the largest after its
recomputation is the true maximum.
"""

from __future__ import annotations

from bisect import bisect_left, bisect_right, insort
from collections import defaultdict
from heapq import heapify, heappop, heappush

import numpy as np

from network_sim.street.schemes.scheme import Scheme


class Coverage:
    """Coverage of a set of images, and the gain of one more image.

    An image of cell c taken at tau covers c during [tau, tau + T_v). The utility of a set A is F(A) = sum
    over cells of the length of the union of its intervals: monotone and submodular.
    """

    def __init__(self, validity_ns: int) -> None:
        self.validity_ns = validity_ns
        self._taken_ns: defaultdict[int, list[int]] = defaultdict(list)

    def gain_ns(self, cell: int, captured_ns: int) -> int:
        """Return F(A + a) - F(A). All intervals have one length, so only the two nearest images matter."""
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
        """Add an image to the set."""
        insort(self._taken_ns[cell], captured_ns)

    def remove(self, cell: int, captured_ns: int) -> None:
        """Remove an image that did not arrive from the set."""
        taken = self._taken_ns[cell]
        del taken[bisect_left(taken, captured_ns)]


def select(coverage: Coverage, cells: list[int], captured_ns: list[int], k: int | None) -> list[int]:
    """Choose the images with the largest gains, and count them as covered.

    Args:
        coverage: Coverage so far; the chosen images are added to it.
        cells: (T,) cells of the offered images.
        captured_ns: (T,) capture times of the offered images.
        k: Most images to choose; None sets no limit.

    Returns:
        Indices of the chosen images, by falling gain; of equal gains the first offered comes first. Each
        gain is at least half of the validity.
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
    """The scheme GREEDY(k), which counts requested images as covered until they are reported missing."""

    def __init__(self, validity_ns: int, k: int | None) -> None:
        self.coverage = Coverage(validity_ns)
        self.k = k

    def chosen(self, cells: np.ndarray, captured_ns: np.ndarray, now_ns: int) -> list[int]:
        """Return the indices of the images to request, largest gain first."""
        return select(self.coverage, cells.tolist(), captured_ns.tolist(), self.k)

    def missed(self, cell: int, captured_ns: int) -> None:
        """Remove a requested image that did not arrive from the coverage."""
        self.coverage.remove(cell, captured_ns)
