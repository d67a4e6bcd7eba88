"""Fast and robust ICP: Welsch weights on a shrinking scale, accelerated (SPEC 4.6).

It is the published method most similar to CEICP-A.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from pipeline.config import RegistrationConfig
from pipeline.kernels.point_sets import neighbour_distances_m
from pipeline.registration.ceicp import SIGMA_MIN_OF_GATE
from pipeline.registration.matching import Matching
from pipeline.registration.weighting import PairWeighting, PairWeights
from pipeline.types import FloatArray, PointCloud

FIRST_NU_OF_MEDIAN = 3.0
"""Ratio of the first scale to the median distance of the first matching."""
LAST_NU_OF_SPACING = {"point": 1.0 / (3.0 * np.sqrt(3.0)), "plane": 1.0 / 6.0}
"""Ratio of the last scale to the target's spacing, by metric."""
SHRINKING = 0.5
SPACING_NEIGHBOURS = 6


@dataclass(frozen=True, slots=True)
class FastRobustIcp(PairWeighting):
    """Weights exp(-d^2 / 2 nu^2); nu is halved whenever the poses have converged at it.

    For each nu the energy is the mean of 1 - exp(-d^2 / 2 nu^2), with the distances between points for both
    metrics. Plain steps of the point metric never raise it; extrapolated steps that raise it are undone.

    Source: Zhang, Yao, Deng, "Fast and robust iterative closest point", TPAMI 2021; constants as in the
    authors' program.
    """

    accelerated = True
    nu_min_m: float
    nu_m: float | None = None
    """Scale; None estimates it from the first matching."""

    @classmethod
    def starting(cls, config: RegistrationConfig, source: PointCloud, target: PointCloud) -> FastRobustIcp:
        """Return the first state, with the last scale from the target's spacing."""
        nu_min_m = LAST_NU_OF_SPACING[config.metric] * neighbourhood_m(target.points_m)
        return cls(max(nu_min_m, SIGMA_MIN_OF_GATE * config.gate_m))

    def weigh(self, matching: Matching) -> PairWeights:
        """Weigh all pairs by the Welsch function."""
        squared_m2 = matching.distances_m**2
        nu_m = max(self.nu_min_m, FIRST_NU_OF_MEDIAN * float(np.median(matching.distances_m)))
        if self.nu_m is not None:
            nu_m = self.nu_m
        closest_first = np.exp(-0.5 * (squared_m2 - squared_m2.min()) / nu_m**2)
        energy = float(np.mean(-np.expm1(-0.5 * squared_m2 / nu_m**2)))
        rows = np.arange(len(squared_m2))
        return PairWeights(rows, closest_first / closest_first.sum(), nu_m, energy=energy)

    @property
    def settled(self) -> bool:
        """Whether the scale has reached its smallest value."""
        return self.nu_m is not None and self.nu_m <= self.nu_min_m

    def following(self, kept: PairWeights, still: bool) -> FastRobustIcp:
        """Return the next state, with half the scale if the poses have converged."""
        factor = SHRINKING if still else 1.0
        return replace(self, nu_m=max(self.nu_min_m, factor * kept.sigma_m))


def neighbourhood_m(points_m: FloatArray) -> float:
    """Return the median over (N, 3) points of their median distance to the nearest six others."""
    return float(np.median(np.median(neighbour_distances_m(points_m, SPACING_NEIGHBOURS), axis=1)))
