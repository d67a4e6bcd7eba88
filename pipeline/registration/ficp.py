"""Fractional ICP: the share of inliers among the pairs is estimated from their distances (SPEC 4.6)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pipeline.registration.matching import Matching
from pipeline.registration.weighting import PairWeighting, PairWeights, closest_rows, evenly
from pipeline.types import FloatArray

LAMBDA = 0.95
"""Exponent that rewards every kept pair, for 3-D points (once libpointmatcher's default; now 2.35)."""
SMALLEST_FRACTION = 0.05


@dataclass(frozen=True, slots=True)
class Ficp(PairWeighting):
    """FICP: equal weights for the closest fraction f of the pairs, chosen at every matching.

    Source: Phillips, Liu, Tomasi, "Outlier robust ICP for minimizing fractional RMSD", 3DIM 2007.
    """

    def weigh(self, matching: Matching) -> PairWeights:
        """Keep the fraction of the closest pairs that has the least fractional RMSD."""
        return evenly(closest_rows(matching.distances_m, inlier_fraction(matching.distances_m)))


def inlier_fraction(distances_m: FloatArray, exponent: float = LAMBDA) -> float:
    """Find the f in [0.05, 1] that minimises FRMSD(f) = f^-lambda sqrt(mean of the f n smallest d^2).

    Of several minima the largest f is returned, so that perfect pairs are all kept.

    Args:
        distances_m: (M,) distances, M >= 1.
        exponent: lambda.
    """
    total = len(distances_m)
    squared_m2 = np.cumsum(np.sort(distances_m) ** 2)
    counts = np.arange(int(np.ceil(SMALLEST_FRACTION * total)), total + 1)
    frmsd_m = (counts / total) ** -exponent * np.sqrt(squared_m2[counts - 1] / counts)
    return float(counts[::-1][np.argmin(frmsd_m[::-1])] / total)
