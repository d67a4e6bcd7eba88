"""CEICP exactly as printed in the thesis (eqs. 3.10-3.17, SPEC 4.3): for comparison, not for use."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from packetmesh.errors import InputError
from pipeline.config import RegistrationConfig
from pipeline.registration.matching import Matching
from pipeline.registration.residual import DegenerateError
from pipeline.registration.weighting import PairWeighting, PairWeights
from pipeline.types import FloatArray, PointCloud

Unit = Literal["mm", "m"]
_PER_METRE = {"mm": 1000.0, "m": 1.0}
_LEAST_SIGMA = 1.0 / np.sqrt(2.0 * np.pi)
"""Scale, in the unit of length, below which the density exceeds one and its logarithm changes sign."""


@dataclass(frozen=True, slots=True)
class CeicpLiteral(PairWeighting):
    """Weights -f log f, where f is a Gaussian density fitted to the kept distances in a unit of length.

    f has the dimension 1 / length, so the weights, and with them the result, depend on the unit.
    Centroids are unweighted (eq. 3.12). The corrections of SPEC 4.3 that do not concern the weights are
    applied: R = U V^T without reflections.
    """

    fixed_gate_m: float
    unit: Unit

    @classmethod
    def starting(cls, config: RegistrationConfig, source: PointCloud, target: PointCloud) -> CeicpLiteral:
        """Return the first state, with the configured gate and unit."""
        return cls(config.gate_m, config.unit)

    def weigh(self, matching: Matching) -> PairWeights:
        """Weigh the pairs within the gate; mu and sigma are mean and sample deviation of their distances."""
        rows = np.flatnonzero(matching.distances_m <= self.fixed_gate_m)
        if len(rows) < 2:
            return PairWeights(rows, np.ones(len(rows)))
        per_metre = _PER_METRE[self.unit]
        information, sigma = density_information(per_metre * matching.distances_m[rows])
        if not (information >= 0.0).all():
            raise self._refusal(sigma)
        return PairWeights(rows, information / information.sum(), sigma / per_metre)

    @property
    def gate_m(self) -> float:
        """Distance beyond which no pair counts."""
        return self.fixed_gate_m

    @property
    def unweighted_centroids(self) -> bool:
        """True: centroids are unweighted, as printed in eq. 3.12."""
        return True

    def _refusal(self, sigma: float) -> InputError | DegenerateError:
        """Return the error for negative weights.

        In metres, where registrations fail from the start, it is an InputError; in millimetres, where they
        fail near the goal, a DegenerateError that ends the registration.
        """
        reason = (
            f"the distances' standard deviation is {sigma:.2g} {self.unit}, below {_LEAST_SIGMA:.3f} "
            f"{self.unit}: f is a density, which there exceeds 1/{self.unit}, so that log f changes sign and "
            "the weight -f log f turns negative"
        )
        if self.unit == "m":
            return InputError(f"ceicp-literal cannot weigh in metres: {reason}; try unit=mm.")
        return DegenerateError(reason)


def density_information(distances: FloatArray) -> tuple[FloatArray, float]:
    """Compute the thesis's weights -f log f of (M,) distances, M >= 2; negative if f > 1 (eqs. 3.10-3.11).

    Returns:
        (M,) weights, not normalised, and the sample standard deviation, in the unit of the distances.
    """
    sigma = float(np.std(distances, ddof=1))
    if sigma == 0.0:
        return np.full(len(distances), -np.inf), sigma
    z = (distances - distances.mean()) / sigma
    log_f = -0.5 * z**2 - np.log(sigma * np.sqrt(2.0 * np.pi))
    return -np.exp(log_f) * log_f, sigma
