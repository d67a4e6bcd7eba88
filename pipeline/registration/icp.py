"""Plain ICP with equal weights for all closest pairs (thesis Table 3.1, SPEC 4.2), and trimmed ICP."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pipeline.config import RegistrationConfig
from pipeline.registration.matching import Matching
from pipeline.registration.weighting import PairWeighting, PairWeights, closest_rows, evenly
from pipeline.types import PointCloud


@dataclass(frozen=True, slots=True)
class Icp(PairWeighting):
    """Plain ICP: equal weights, no gate."""

    def weigh(self, matching: Matching) -> PairWeights:
        """Keep all pairs, with equal weights."""
        return evenly(np.arange(len(matching.distances_m)))


@dataclass(frozen=True, slots=True)
class TrimmedIcp(PairWeighting):
    """Trimmed ICP: equal weights for a fixed share of the pairs, the closest ones.

    Source: Chetverikov, Svirko, Stepanov, Krsek, "The trimmed iterative closest point algorithm",
    ICPR 2002; here the overlap is given, not searched.
    """

    share: float
    """Share of the pairs that is kept, above 0 up to 1."""

    @classmethod
    def starting(cls, config: RegistrationConfig, source: PointCloud, target: PointCloud) -> TrimmedIcp:
        """Return the first state, with the configured share."""
        return cls(config.trim)

    def weigh(self, matching: Matching) -> PairWeights:
        """Keep the closest share of the pairs, with equal weights."""
        return evenly(closest_rows(matching.distances_m, self.share))
