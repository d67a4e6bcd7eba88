"""Road coverage: which road cells cameras saw in each time span, and which of these sights arrived.

A sight is a pair of a road cell (SPEC 6.2) and a time span of ``scheme.validity_s``.
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
    """The sights of a run after its warm-up, one per row."""

    cell: NDArray[np.int64]
    """(S,) cell of each sight."""
    seen_ns: NDArray[np.int64]
    """(S,) time of the first image of each sight."""
    covered_ns: NDArray[np.int64]
    """(S,) time of the first arrival of one of its images; ``NEVER_NS`` if none arrived."""
    arrived: int
    """Number of images that arrived."""

    def counts(self, t_ns: int, cells: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Count the sights of each cell until ``t_ns``: (cells,) all, and (cells,) with an arrived image."""
        seen, covered = self.seen_ns <= t_ns, self.covered_ns <= t_ns
        return np.bincount(self.cell[seen], minlength=cells), np.bincount(self.cell[covered], minlength=cells)


def road_coverage(trace: NetworkTrace) -> RoadCoverage | None:
    """Find the sights of a run; None if no image of a road was taken, or image events were not kept."""
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
