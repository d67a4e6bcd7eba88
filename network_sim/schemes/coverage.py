"""Coverage of cells of the road network over time by a set of images.

Our reconstruction (SPEC 6.2) of the coverage goal of Bruno & Nurchis (arXiv 1311.6013), of which only the
abstract and the first lines could be read. An image of cell c taken at tau covers c during [tau, tau + T_v).
The utility of a set A is F(A) = sum over cells of the length of the union of its intervals: monotone and
submodular.
"""

from __future__ import annotations

from bisect import bisect_left, bisect_right, insort
from collections import defaultdict


class Coverage:
    """The images of a set by cell, and the gain of one more."""

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
