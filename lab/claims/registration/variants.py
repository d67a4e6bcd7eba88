"""Variants of methods: a part removed for the ablations of SPEC 4.8, or a parameter exposed for tuning."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import numpy as np

from pipeline.config import RegistrationConfig
from pipeline.registration.ceicp import FACING_SPREAD, CeicpA, CeicpN
from pipeline.registration.ceicp_literal import CeicpLiteral
from pipeline.registration.ficp import LAMBDA, Ficp, inlier_fraction
from pipeline.registration.icp import Icp
from pipeline.registration.matching import Matching
from pipeline.registration.methods import METHODS, MethodStart
from pipeline.registration.ricp import Ricp
from pipeline.registration.weighting import PairWeighting, PairWeights, closest_rows, evenly
from pipeline.types import FloatArray, PointCloud


@dataclass(frozen=True, slots=True)
class GatedIcp(Icp):
    """Equal weights within a fixed gate: ICP + T_d."""

    fixed_gate_m: float

    def weigh(self, matching: Matching) -> PairWeights:
        """Return all pairs within the gate, with equal weights."""
        return evenly(np.flatnonzero(matching.distances_m <= self.fixed_gate_m))

    @property
    def gate_m(self) -> float:
        """Distance beyond which no pair counts."""
        return self.fixed_gate_m


@dataclass(frozen=True, slots=True)
class GaussianA(CeicpA):
    """CEICP-A without the entropy factor: w = p, which with the plane metric has the normals' factor, too."""

    def weigh(self, matching: Matching) -> PairWeights:
        """Return the pairs of CEICP-A, with their probabilities as weights."""
        kept = CeicpA.weigh(self, matching)
        if matching.cosines is None:
            return _gaussian(kept, matching)
        return _gaussian(kept, matching, (1.0 - matching.cosines[kept.rows]) / FACING_SPREAD**2)


@dataclass(frozen=True, slots=True)
class GaussianN(CeicpN):
    """CEICP-N without the entropy factor: w = p."""

    def weigh(self, matching: Matching) -> PairWeights:
        """Return the pairs of CEICP-N, with plain Gaussian weights of the same scale."""
        return _gaussian(CeicpN.weigh(self, matching), matching)


@dataclass(frozen=True, slots=True)
class HardGateA(CeicpA):
    """CEICP-A's shrinking gate with equal weights inside."""

    def weigh(self, matching: Matching) -> PairWeights:
        """Return the pairs of CEICP-A, with equal weights."""
        kept = CeicpA.weigh(self, matching)
        return replace(evenly(kept.rows), sigma_m=kept.sigma_m)


@dataclass(frozen=True, slots=True)
class WeightedCentroidsLiteral(CeicpLiteral):
    """The thesis's formula with centroids weighted like the pairs; those of eq. 3.12 are unweighted."""

    @property
    def unweighted_centroids(self) -> bool:
        """False, as a weighted least-squares fit requires."""
        return False


@dataclass(frozen=True, slots=True)
class GatedRicp(Ricp):
    """RICP without pairs beyond a gate."""

    fixed_gate_m: float = float("inf")

    def weigh(self, matching: Matching) -> PairWeights:
        """Return RICP's choice among the pairs within the gate."""
        near = np.flatnonzero(matching.distances_m <= self.fixed_gate_m)
        if len(near) <= 4:
            return evenly(near)
        kept = Ricp.weigh(self, matching.select(near))
        return replace(kept, rows=near[kept.rows])

    @property
    def gate_m(self) -> float:
        """Distance beyond which no pair counts."""
        return self.fixed_gate_m


@dataclass(frozen=True, slots=True)
class FicpWithExponent(Ficp):
    """FICP with a settable lambda; Ficp's is 0.95."""

    exponent: float

    def weigh(self, matching: Matching) -> PairWeights:
        """Return the fraction of the closest pairs with the least fractional RMSD."""
        fraction = inlier_fraction(matching.distances_m, self.exponent)
        return evenly(closest_rows(matching.distances_m, fraction))


def _gaussian(kept: PairWeights, matching: Matching, penalty: FloatArray | float = 0.0) -> PairWeights:
    """Return the pairs with normalised weights exp(-d^2 / 2 sigma^2 - penalty); ``penalty`` is (M,) or 0."""
    variance_m2 = max(kept.sigma_m**2, np.finfo(float).tiny)
    kernel = np.exp(-0.5 * matching.distances_m[kept.rows] ** 2 / variance_m2 - penalty)
    return PairWeights(kept.rows, kernel / kernel.sum() if len(kernel) else kernel, kept.sigma_m)


def _as_kind(kind: type[PairWeighting], method: str) -> MethodStart:
    """Return a function that makes a method's first state as an instance of its subclass ``kind``."""

    def start(config: RegistrationConfig, source: PointCloud, target: PointCloud) -> PairWeighting:
        state = METHODS[method](config, source, target)
        return kind(**{part.name: getattr(state, part.name) for part in fields(state)})

    return start


def _fixed_sigma(config: RegistrationConfig, source: PointCloud, target: PointCloud) -> PairWeighting:
    """Return CEICP-A with a constant scale: three sigma are the gate T_d."""
    sigma_m = config.gate_m / 3.0
    state = CeicpA.starting(config, source, target)
    return replace(state, sigma_m=sigma_m, sigma_0_m=sigma_m, sigma_min_m=sigma_m)


VARIANTS: dict[str, tuple[str, MethodStart]] = {
    "icp-gated": ("icp", lambda config, source, target: GatedIcp(config.gate_m)),
    "ceicp-a-gaussian": ("ceicp-a", _as_kind(GaussianA, "ceicp-a")),
    "ceicp-a-hard-gate": ("ceicp-a", _as_kind(HardGateA, "ceicp-a")),
    "ceicp-a-fixed-sigma": ("ceicp-a", _fixed_sigma),
    "ceicp-n-gaussian": ("ceicp-n", _as_kind(GaussianN, "ceicp-n")),
    "ceicp-literal-centroids": ("ceicp-literal", _as_kind(WeightedCentroidsLiteral, "ceicp-literal")),
}
"""By variant: the name of its method in the config, and the function that makes its first state."""

TUNABLE: dict[str, MethodStart] = {
    "ricp": lambda config, source, target: GatedRicp(config.seed, fixed_gate_m=config.gate_m),
    "ficp": lambda config, source, target: FicpWithExponent(LAMBDA),
}
"""Methods whose tuned constant is not a setting: the function makes a first state with it as a field."""
