"""Trimmed ICP: only the closest share of the pairs counts (Chetverikov et al. 2002)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pipeline.registration.matching import Matching
from pipeline.registration.weighting import PairWeighting, PairWeights
from pipeline.types import FloatArray, IntArray


@dataclass(frozen=True, slots=True)
class TrimmedIcp(PairWeighting):
    """Equal weights for a fixed share of the pairs, the closest ones.

    Source: Chetverikov, Svirko, Stepanov, Krsek, "The trimmed iterative closest point algorithm",
    ICPR 2002, with the overlap given instead of searched.
    """

    share: float
    """Share of the pairs that is kept, above 0 up to 1."""

    def weigh(self, matching: Matching) -> PairWeights:
        """The closest share, with equal weights."""
        return evenly(closest_rows(matching.distances_m, self.share))


def closest_rows(distances_m: FloatArray, share: float) -> IntArray:
    """(K,) rows of the smallest ``share`` of (M,) distances, rounded up, in their own order."""
    count = int(np.ceil(share * len(distances_m) - 1e-9))
    return np.sort(np.argsort(distances_m, kind="stable")[:count])


def evenly(rows: IntArray) -> PairWeights:
    """The pairs at (K,) ``rows``, all with the same weight."""
    return PairWeights(rows, np.full(len(rows), 1.0 / max(len(rows), 1)))
