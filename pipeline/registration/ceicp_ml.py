"""CEICP-ML: minimisation of the cross-entropy of target and source by EM (SPEC 4.4)."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from pipeline.config import RegistrationConfig
from pipeline.registration.ceicp import CeicpA
from pipeline.registration.matching import Matching
from pipeline.registration.weighting import PairWeighting, PairWeights
from pipeline.types import FloatArray, PointCloud

NEIGHBOURS = 5
OUTLIER_SHARE = 0.2
"""Prior probability w0 that a target point has no counterpart in the source."""
NEGLIGIBLE = 1e-9
"""Pairs with a smaller responsibility are left out."""
STEADY = 0.01
"""Relative change below which the scale counts as constant."""


@dataclass(frozen=True, slots=True)
class CeicpMl(PairWeighting):
    """Weights are the responsibilities of the five nearest source points for every target point.

    The method minimises -(1/|P|) sum_j log((1 - w0)/|Q| sum_i N(p_j; x_i, sigma^2 I) + w0/V), that is
    D_KL(P || Q_T), by expectation and conditional maximisation: responsibilities at the previous scale,
    then the scale from them, then (in the loop) the motion. It is equal to EM-ICP (Granger, Pennec 2002)
    and to coherent point drift (Myronenko, Song 2010) truncated to five neighbours.
    """

    direction = "p2q"
    """Target points are matched to source points."""
    sigma_min_m: float
    outlier_density: float
    """w0 / (1 - w0) |Q| / V, per cubic metre."""
    count: int
    """Number of nearest source points that are paired with every target point."""
    sigma_m: float | None = None
    """Scale of the responsibilities; None estimates it from the first matching."""
    steady: bool = False
    """Whether the scale is constant."""

    @classmethod
    def starting(cls, config: RegistrationConfig, source: PointCloud, target: PointCloud) -> CeicpMl:
        """Return the first state: CEICP-A's smallest scale, outliers uniform in the target's box."""
        density = len(source) / box_volume_m3(target.points_m, config.gate_m)
        return cls(
            CeicpA.starting(config, source, target).sigma_min_m,
            OUTLIER_SHARE / (1.0 - OUTLIER_SHARE) * density,
            min(NEIGHBOURS, len(source)),
        )

    def weigh(self, matching: Matching) -> PairWeights:
        """Weigh by normalised responsibilities; the result's ``sigma_m`` is the scale estimated from them."""
        squared_m2 = matching.distances_m.reshape(-1, self.count) ** 2
        sigma_m = self.sigma_m
        if sigma_m is None:
            sigma_m = max(self.sigma_min_m, float(np.sqrt(squared_m2.mean() / 3.0)))
        variance_m2 = sigma_m**2
        outlier = (2.0 * np.pi * variance_m2) ** 1.5 * self.outlier_density
        gamma = responsibilities(squared_m2, variance_m2, outlier).reshape(-1)
        rows = np.flatnonzero(gamma > NEGLIGIBLE)
        if not len(rows):
            return PairWeights(rows, np.empty(0))
        weights = gamma[rows] / gamma[rows].sum()
        fitted_m = float(np.sqrt(weights @ squared_m2.reshape(-1)[rows] / 3.0))
        return PairWeights(rows, weights, max(self.sigma_min_m, fitted_m))

    @property
    def settled(self) -> bool:
        """Whether the scale is constant."""
        return self.steady

    @property
    def neighbours(self) -> int:
        """Number of neighbours: five, or all source points of a smaller cloud."""
        return self.count

    def following(self, kept: PairWeights, still: bool) -> CeicpMl:
        """Return the next state, with the newly estimated scale."""
        steady = self.sigma_m is not None and abs(kept.sigma_m / self.sigma_m - 1.0) <= STEADY
        return replace(self, sigma_m=kept.sigma_m, steady=steady)


def responsibilities(squared_m2: FloatArray, variance_m2: float, outlier: float) -> FloatArray:
    """Compute gamma_ij = exp(-d_ij^2 / 2 sigma^2) / (sum_i exp(-d_ij^2 / 2 sigma^2) + c).

    Args:
        squared_m2: (T, k) squared distances of every target point to its k source points.
        variance_m2: sigma^2.
        outlier: c, likelihood of an outlier relative to a kernel of peak 1.

    Returns:
        (T, k) responsibilities; one minus the sum of a row is the probability of an outlier.
    """
    kernel = np.exp(-0.5 * squared_m2 / variance_m2)
    return kernel / (kernel.sum(axis=1, keepdims=True) + outlier)


def box_volume_m3(points_m: FloatArray, shortest_m: float) -> float:
    """Return the volume of the box around (N, 3) points along their principal axes (rotation invariant).

    Shorter sides count as ``shortest_m``, so that a flat cloud has a volume.
    """
    centered_m = points_m - points_m.mean(axis=0)
    _, axes = np.linalg.eigh(centered_m.T @ centered_m)
    return float(np.prod(np.maximum(np.ptp(centered_m @ axes, axis=0), shortest_m)))
