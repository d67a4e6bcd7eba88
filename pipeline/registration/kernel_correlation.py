"""Kernel correlation: every point is paired with the ten nearest of the other cloud (SPEC 4.4)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pipeline.config import RegistrationConfig
from pipeline.registration.ceicp import CeicpA
from pipeline.registration.matching import Matching
from pipeline.registration.weighting import PairWeights
from pipeline.types import PointCloud

NEIGHBOURS = 10


@dataclass(frozen=True, slots=True)
class KernelCorrelation(CeicpA):
    """Gaussian weights for the ten nearest points of every point, scale and gate as in CEICP-A.

    The fixed point of the weighted fit is where -sum_ij exp(-|p_j - T q_i|^2 / 2 sigma^2) is stationary:
    Tsin, Kanade, "A correlation-based approach to robust point set registration", ECCV 2004. CEICP-A
    takes only the nearest point, and its weights fall off more slowly with the distance. The source's normals
    are not used here.
    """

    facing = False

    @classmethod
    def starting(
        cls, config: RegistrationConfig, source: PointCloud, target: PointCloud
    ) -> KernelCorrelation:
        """Return the first state: the scales of CEICP-A, with all points at every scale."""
        first = CeicpA.starting(config, source, target)
        return cls(first.sigma_m, first.sigma_0_m, first.sigma_min_m, first.decay)

    def weigh(self, matching: Matching) -> PairWeights:
        """Weigh the pairs within three sigma."""
        rows = np.flatnonzero(matching.distances_m <= self.gate_m)
        kernel = np.exp(-0.5 * (matching.distances_m[rows] / self.sigma_m) ** 2)
        return PairWeights(rows, kernel / max(kernel.sum(), np.finfo(float).tiny), self.sigma_m)

    @property
    def neighbours(self) -> int:
        """Number of neighbours of every point: ten."""
        return NEIGHBOURS
