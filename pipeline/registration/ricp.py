"""Robust ICP: least median of squares over small random subsets of the pairs (SPEC 4.6)."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from pipeline.config import RegistrationConfig
from pipeline.registration.matching import Matching
from pipeline.registration.weighting import MAD_TO_SIGMA, PairWeighting, PairWeights, evenly
from pipeline.types import FloatArray, PointCloud

SUBSETS = 60
"""Number of subsets per iteration. If 40 % of the pairs are wrong, 34 subsets contain one of four right pairs
with a probability of 99 %."""
SUBSET_PAIRS = 4
KEPT_SIGMAS = 2.5


@dataclass(frozen=True, slots=True)
class Ricp(PairWeighting):
    """RICP: equal weights for the pairs that agree with the motion of least median squared residual.

    The candidates are the rigid motions of the subsets and the current pose. Pairs with a residual
    up to 2.5 robust standard deviations s = 1.4826 (1 + 5 / (n - 4)) sqrt(median) are kept.

    Source: Trucco, Fusiello, Roberto, "Robust motion and correspondence of noisy 3-D point sets with
    missing data", Pattern Recognition Letters 20, 1999.
    """

    seed: int
    iteration: int = 0

    @classmethod
    def starting(cls, config: RegistrationConfig, source: PointCloud, target: PointCloud) -> Ricp:
        """Return the first state, with the configured seed."""
        return cls(config.seed)

    def weigh(self, matching: Matching) -> PairWeights:
        """Keep the pairs that agree with the best candidate, with equal weights."""
        rng = np.random.default_rng((self.seed, self.iteration))
        total = len(matching.distances_m)
        subsets = rng.integers(total, size=(SUBSETS, SUBSET_PAIRS))
        rotations, translations_m = rigid_fits(matching.moved_m[subsets], matching.target_m[subsets])
        rotations = np.concatenate([np.eye(3)[None], rotations])
        translations_m = np.concatenate([np.zeros((1, 3)), translations_m])
        moved_m = matching.moved_m @ rotations.transpose(0, 2, 1) + translations_m[:, None]
        squared_m2 = np.sum((moved_m - matching.target_m) ** 2, axis=2)
        medians_m2 = np.median(squared_m2, axis=1)
        best = int(np.argmin(medians_m2))
        sigma_m = MAD_TO_SIGMA * (1.0 + 5.0 / max(total - 4, 1)) * np.sqrt(medians_m2[best])
        return evenly(np.flatnonzero(np.sqrt(squared_m2[best]) <= KEPT_SIGMAS * sigma_m))

    def following(self, kept: PairWeights, still: bool) -> Ricp:
        """Return the next state, which draws other subsets."""
        return replace(self, iteration=self.iteration + 1)


def rigid_fits(source_m: FloatArray, target_m: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Compute the rigid motions of many small sets of pairs by Procrustes (SPEC 4.1).

    Args:
        source_m: (S, K, 3) points that move.
        target_m: (S, K, 3) their partners.

    Returns:
        (S, 3, 3) rotations and (S, 3) translations; an arbitrary best one if a set is ambiguous.
    """
    source_center_m, target_center_m = source_m.mean(axis=1), target_m.mean(axis=1)
    covariance = np.einsum(
        "ski,skj->sij", target_m - target_center_m[:, None], source_m - source_center_m[:, None]
    )
    U, _, Vt = np.linalg.svd(covariance)
    U[:, :, 2] *= np.sign(np.linalg.det(U @ Vt))[:, None]
    rotations = U @ Vt
    return rotations, target_center_m - np.einsum("sij,sj->si", rotations, source_center_m)
