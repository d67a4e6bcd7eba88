"""What a registration method is: a rule that weighs the pairs of a matching.

A new method is a subclass of ``PairWeighting`` in a file of its own, entered in ``pipeline.config.METHODS``.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from pipeline.config import Direction, RegistrationConfig
from pipeline.registration.matching import Matching
from pipeline.types import FloatArray, IntArray, PointCloud

MAD_TO_SIGMA = 1.4826
"""Standard deviation of a normal distribution over its median absolute deviation."""


@dataclass(frozen=True, slots=True)
class PairWeights:
    """The pairs a method keeps, and how much each counts."""

    rows: IntArray
    """(M,) kept rows of the matching."""
    weights: FloatArray
    """(M,) non-negative, summing to one (empty when nothing is kept)."""
    sigma_m: float = float("nan")
    """Scale of the weight function; NaN for methods without one."""
    entropy_nat: float = float("nan")
    """Entropy of the matching; NaN for methods without probabilities."""
    gate_m: float = float("inf")
    """Distance beyond which no pair was kept, where it follows from the distances themselves."""
    energy: float = float("nan")
    """What an accelerated method decreases, at this pose; NaN for all others."""


@dataclass(frozen=True, slots=True)
class PairWeighting(ABC):
    """A method in the state of one iteration; plain defaults for all but the weights."""

    direction: ClassVar[Direction | None] = None
    """The direction the method insists on; None for the configured one."""
    accelerated: ClassVar[bool] = False
    """Whether Anderson acceleration extrapolates the poses."""

    @classmethod
    def starting(cls, config: RegistrationConfig, source: PointCloud, target: PointCloud) -> PairWeighting:
        """The method in the state of its first iteration.

        Args:
            config: the method's parameters.
            source: the thinned cloud that moves.
            target: the thinned cloud that stays.

        Raises:
            InputError: the clouds lack what the method needs.
        """
        return cls()

    @abstractmethod
    def weigh(self, matching: Matching) -> PairWeights:
        """Which pairs count, and how much."""

    @property
    def gate_m(self) -> float:
        """Distance beyond which no pair counts, known before the search, which it shortens."""
        return float("inf")

    @property
    def settled(self) -> bool:
        """Whether the schedule has reached its end, so that a small update means convergence."""
        return True

    @property
    def tolerance(self) -> float:
        """Factor on the tolerances of the stop rule in this state."""
        return 1.0

    @property
    def source_share(self) -> float:
        """Share of the source's points that this iteration uses, always the same ones for one share."""
        return 1.0

    @property
    def target_share(self) -> float:
        """Share of the target's points that this iteration uses, always the same ones for one share."""
        return 1.0

    @property
    def neighbours(self) -> int:
        """Nearest points that every point is paired with; a matching's rows come in blocks, nearest first."""
        return 1

    @property
    def unweighted_centroids(self) -> bool:
        """Whether the point residual takes plain centroids of the kept pairs, as eq. 3.12 does."""
        return False

    def features(self, cloud: PointCloud) -> FloatArray | None:
        """(N, k) coordinates beside x, y, z in which neighbours are near, in metres; None for none."""
        return None

    def following(self, kept: PairWeights, still: bool) -> PairWeighting:
        """The method in the state of the next iteration.

        Args:
            kept: what this state weighed.
            still: whether the motion of this iteration was below the tolerances.
        """
        return self

    def widened(self) -> PairWeighting | None:
        """A wider state to try when too few pairs are kept, or None."""
        return None


def evenly(rows: IntArray) -> PairWeights:
    """The pairs at (K,) ``rows``, all with the same weight."""
    return PairWeights(rows, np.full(len(rows), 1.0 / max(len(rows), 1)))


def closest_rows(distances_m: FloatArray, share: float) -> IntArray:
    """(K,) rows of the smallest ``share`` of (M,) distances, rounded up, in their own order."""
    count = int(np.ceil(share * len(distances_m) - 1e-9))
    return np.sort(np.argsort(distances_m, kind="stable")[:count])
