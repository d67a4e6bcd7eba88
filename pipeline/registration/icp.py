"""Plain ICP: every closest pair counts the same (thesis Table 3.1, SPEC 4.2)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pipeline.registration.matching import Matching
from pipeline.registration.weighting import PairWeighting, PairWeights, evenly


@dataclass(frozen=True, slots=True)
class Icp(PairWeighting):
    """Equal weights, no gate."""

    def weigh(self, matching: Matching) -> PairWeights:
        """All pairs, with equal weights."""
        return evenly(np.arange(len(matching.distances_m)))
