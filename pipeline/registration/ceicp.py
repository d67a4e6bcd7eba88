"""Cross-entropy ICP in its well-posed forms CEICP-N, -A and -R: pair weights -p log p (SPEC 4.4).

The thesis's formula (eqs. 3.10-3.11) takes the logarithm of a density, so its weights depend on the
unit of length and become negative in metres; here p is a probability over the kept pairs.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from pipeline.config import RegistrationConfig
from pipeline.registration.matching import Matching
from pipeline.registration.neighbourhood import median_spacing_m
from pipeline.registration.weighting import MAD_TO_SIGMA, PairWeighting, PairWeights
from pipeline.types import FloatArray, PointCloud

GATE_IN_SIGMAS = 3.0
"""Ratio of CEICP-A's gate T_d,k to its scale sigma_k."""
START_SIGMA_OF_GATE = 1.0 / 1.5
"""Ratio of CEICP-A's first scale sigma_0 to the configured gate T_d."""
SIGMA_MIN_OF_SPACING = 0.6
"""Ratio of CEICP-A's smallest scale to the target's median spacing."""
COARSE_POINTS = 2000
"""Number of points that CEICP-A matches at first, while its kernel is wide."""
SIGMA_MIN_OF_GATE = 1e-3
"""Least ratio of CEICP-A's smallest scale to the gate, for targets whose points coincide."""
FACING_SPREAD = 0.5
"""Scale s of a pair's normals in CEICP-A's p, exp(-(1 - |n . n'|) / s^2): 29 degrees (SPEC 4.11)."""
LEAST_COSINE = 0.5
"""Pairs whose normals differ by more than 60 degrees do not count in CEICP-A."""


@dataclass(frozen=True, slots=True)
class CeicpN(PairWeighting):
    """CEICP-N: a fixed gate, and a scale that is estimated from the kept pairs at every iteration."""

    fixed_gate_m: float

    @classmethod
    def starting(cls, config: RegistrationConfig, source: PointCloud, target: PointCloud) -> CeicpN:
        """Return the first state, with the configured gate."""
        return cls(config.gate_m)

    def weigh(self, matching: Matching) -> PairWeights:
        """Weigh the pairs within the gate; sigma^2 is their mean squared distance."""
        rows = np.flatnonzero(matching.distances_m <= self.fixed_gate_m)
        distances_m = matching.distances_m[rows]
        sigma_m = float(np.sqrt(np.mean(distances_m**2))) if len(rows) else float("nan")
        return PairWeights(rows, *entropy_weights(distances_m, sigma_m))

    @property
    def gate_m(self) -> float:
        """Distance beyond which no pair counts."""
        return self.fixed_gate_m


@dataclass(frozen=True, slots=True)
class CeicpA(PairWeighting):
    """CEICP-A: scale and gate shrink by the same factor at each iteration.

    With the plane metric p also depends on the angle between a pair's normals: where two clouds overlap only
    in part, points at the rim of one would be paired with walls of another direction (SPEC 4.11).
    """

    facing: ClassVar[bool] = True
    sigma_m: float
    sigma_0_m: float
    sigma_min_m: float
    decay: float
    least_source_share: float = 1.0
    """Least share of the source's points that are matched, while the kernel is wide."""
    least_target_share: float = 1.0
    """Least share of the target's points that are matched, while the kernel is wide."""
    may_widen: bool = True
    """Whether the scale may still be doubled (once), when too few pairs are kept."""

    @classmethod
    def starting(cls, config: RegistrationConfig, source: PointCloud, target: PointCloud) -> CeicpA:
        """Return the first state, with sigma_0 = gate / 1.5."""
        sigma_min_m = config.sigma_min_m or _smallest_sigma_m(target, config.gate_m)
        sigma_0_m = max(START_SIGMA_OF_GATE * config.gate_m, sigma_min_m)
        source_share = min(1.0, COARSE_POINTS / len(source)) if config.direction == "q2p" else 1.0
        target_share = min(1.0, COARSE_POINTS / len(target)) if config.direction == "p2q" else 1.0
        return cls(sigma_0_m, sigma_0_m, sigma_min_m, config.sigma_decay, source_share, target_share)

    def weigh(self, matching: Matching) -> PairWeights:
        """Weigh the pairs within three sigma, and within 60 degrees if they have normals."""
        near, cosines = matching.distances_m <= self.gate_m, matching.cosines
        if cosines is None:
            rows = np.flatnonzero(near)
            return PairWeights(rows, *entropy_weights(matching.distances_m[rows], self.sigma_m))
        rows = np.flatnonzero(near & (cosines >= LEAST_COSINE))
        turned = (1.0 - cosines[rows]) / FACING_SPREAD**2
        return PairWeights(rows, *entropy_weights(matching.distances_m[rows], self.sigma_m, turned))

    @property
    def gate_m(self) -> float:
        """Distance beyond which no pair counts."""
        return GATE_IN_SIGMAS * self.sigma_m

    @property
    def settled(self) -> bool:
        """Whether the scale has reached its smallest value."""
        return self.sigma_m <= self.sigma_min_m

    @property
    def source_share(self) -> float:
        """Share of the matched source points: 1 at the smallest scale, proportionally less at wider ones."""
        return self._share(self.least_source_share)

    @property
    def target_share(self) -> float:
        """Like ``source_share``, for matching from the target to the source."""
        return self._share(self.least_target_share)

    def _share(self, least: float) -> float:
        return min(1.0, max(least, self.sigma_min_m / self.sigma_m))

    def following(self, kept: PairWeights, still: bool) -> CeicpA:
        """Return the next state, with a smaller scale."""
        return replace(self, sigma_m=max(self.sigma_min_m, self.decay * self.sigma_m))

    def widened(self) -> CeicpA | None:
        """Return the state with twice the scale, at most sigma_0; None if it was already widened once."""
        if not self.may_widen:
            return None
        return replace(self, sigma_m=min(2.0 * self.sigma_m, self.sigma_0_m), may_widen=False)


@dataclass(frozen=True, slots=True)
class CeicpR(PairWeighting):
    """CEICP-R: sigma_k = min(sigma_k-1, max(sigma_min, 1.4826 median d)), gate 3 sigma_k.

    The weights are those of CEICP-N. The gate is not configured: it follows from the median of all distances,
    so the search must not leave out any pair.
    """

    sigma_min_m: float
    sigma_m: float = float("inf")
    """Scale of the previous iteration, the upper limit of the current one."""

    @classmethod
    def starting(cls, config: RegistrationConfig, source: PointCloud, target: PointCloud) -> CeicpR:
        """Return the first state, with the smallest scale of CEICP-A."""
        return cls(CeicpA.starting(config, source, target).sigma_min_m)

    def weigh(self, matching: Matching) -> PairWeights:
        """Weigh the pairs within three robust sigmas."""
        robust_m = MAD_TO_SIGMA * float(np.median(matching.distances_m))
        sigma_m = min(self.sigma_m, max(self.sigma_min_m, robust_m))
        gate_m = GATE_IN_SIGMAS * sigma_m
        rows = np.flatnonzero(matching.distances_m <= gate_m)
        return PairWeights(rows, *entropy_weights(matching.distances_m[rows], sigma_m), gate_m=gate_m)

    def following(self, kept: PairWeights, still: bool) -> CeicpR:
        """Return the next state, with the scale of the kept pairs as its upper limit."""
        return replace(self, sigma_m=kept.sigma_m)


def _smallest_sigma_m(target: PointCloud, gate_m: float) -> float:
    """Return the largest of 0.6 median target spacings, its median depth noise, and 1e-3 of the gate."""
    noise_m = 0.0
    if target.sigma_m is not None and np.isfinite(target.sigma_m).any():
        noise_m = float(np.nanmedian(target.sigma_m))
    spacing_m = SIGMA_MIN_OF_SPACING * median_spacing_m(target.points_m)
    return max(spacing_m, noise_m, SIGMA_MIN_OF_GATE * gate_m)


def entropy_weights(
    distances_m: FloatArray, sigma_m: float, more: FloatArray | None = None
) -> tuple[FloatArray, float, float]:
    """Compute normalised weights -p log p of a Gaussian p over pairs (SPEC 4.4).

    Args:
        distances_m: (M,) distances of the pairs.
        sigma_m: scale of the distances.
        more: (M,) exponents of a further factor exp(-more) of p.

    Returns:
        (M,) weights summing to one, the scale, and the entropy -sum p log p in nats; NaN without pairs.
    """
    if not len(distances_m):
        return np.empty(0), sigma_m, float("nan")
    exponents = distances_m * distances_m
    exponents *= 0.5 / max(sigma_m**2, np.finfo(float).tiny)
    if more is not None:
        exponents += more
    kernel = np.exp(-exponents)
    total = float(kernel.sum())
    exponents += np.log(total)  # now -log p
    information = kernel * exponents
    entropy = float(information.sum())
    if entropy > 0.0:
        return information / entropy, sigma_m, entropy / total
    return kernel / total, sigma_m, 0.0
