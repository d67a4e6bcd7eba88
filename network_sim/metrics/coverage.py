"""Which pieces of road were seen when, and of which of these sights an image has arrived.

A sight is a cell of the road (SPEC 6.2) in a span of ``scheme.validity_s``, as long as an image shows it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from network_sim.trace.log import NetworkTrace
from network_sim.types import EventKind, to_ns

NEVER_NS = np.iinfo(np.int64).max


@dataclass(frozen=True, slots=True)
class RoadCoverage:
    """The sights of a run after its warm-up, one a row."""

    cell: NDArray[np.int64]
    """(S,) the cell of each."""
    seen_ns: NDArray[np.int64]
    """(S,) when a camera had it first."""
    covered_ns: NDArray[np.int64]
    """(S,) when the first of its images arrived; ``NEVER_NS`` if none did."""
    arrived: int
    """Images that arrived."""

    def counts(self, t_ns: int, cells: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """(cells,) sights of each cell until a time: all, and those of which an image had arrived."""
        seen, covered = self.seen_ns <= t_ns, self.covered_ns <= t_ns
        return np.bincount(self.cell[seen], minlength=cells), np.bincount(self.cell[covered], minlength=cells)


def road_coverage(trace: NetworkTrace) -> RoadCoverage | None:
    """The sights of a run; None if no image of a road was taken, or the images' events were not kept."""
    taken = trace.events.of(EventKind.CAPTURE)
    taken = taken.where((taken.peer >= 0) & (taken.t_ns >= to_ns(trace.config.run.warmup_s)))
    if not len(taken):
        return None
    came = trace.events.of(EventKind.ARRIVE)
    arrival_ns = np.full(int(max(taken.image.max(), came.image.max(initial=0))) + 1, NEVER_NS)
    np.minimum.at(arrival_ns, came.image, came.t_ns)
    window = taken.t_ns // to_ns(trace.config.scheme.validity_s)
    sights, sight = np.unique(np.stack((taken.peer, window)), axis=1, return_inverse=True)
    seen_ns, covered_ns = np.full((2, sights.shape[1]), NEVER_NS)
    np.minimum.at(seen_ns, sight, taken.t_ns)
    np.minimum.at(covered_ns, sight, arrival_ns[taken.image])
    arrived = int((arrival_ns[taken.image] != NEVER_NS).sum())
    return RoadCoverage(sights[0].astype(np.int64), seen_ns, covered_ns, arrived)
