"""CEICP-R: the scale comes from the distances and only ever shrinks (SPEC 4.4)."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from pipeline.config import RegistrationConfig
from pipeline.registration.ceicp import GATE_IN_SIGMAS, CeicpA, entropy_weights
from pipeline.registration.matching import Matching
from pipeline.registration.weighting import MAD_TO_SIGMA, PairWeighting, PairWeights
from pipeline.types import PointCloud


@dataclass(frozen=True, slots=True)
class CeicpR(PairWeighting):
    """CEICP-R: sigma_k = min(sigma_k-1, max(sigma_min, 1.4826 median d)), gate 3 sigma_k.

    Weights as in CEICP-N. Needs no prior gate: its own follows from the median of all distances, so that
    none may be left out of the search before.
    """

    sigma_min_m: float
    sigma_m: float = float("inf")
    """Scale of the previous iteration, which this one's does not exceed."""

    @classmethod
    def starting(cls, config: RegistrationConfig, source: PointCloud, target: PointCloud) -> CeicpR:
        """With the smallest scale of CEICP-A."""
        return cls(CeicpA.starting(config, source, target).sigma_min_m)

    def weigh(self, matching: Matching) -> PairWeights:
        """Pairs within three robust sigmas."""
        robust_m = MAD_TO_SIGMA * float(np.median(matching.distances_m))
        sigma_m = min(self.sigma_m, max(self.sigma_min_m, robust_m))
        gate_m = GATE_IN_SIGMAS * sigma_m
        rows = np.flatnonzero(matching.distances_m <= gate_m)
        return PairWeights(rows, *entropy_weights(matching.distances_m[rows], sigma_m), gate_m=gate_m)

    def following(self, kept: PairWeights, still: bool) -> CeicpR:
        """With the scale of the kept pairs as the bound of the next."""
        return replace(self, sigma_m=kept.sigma_m)
