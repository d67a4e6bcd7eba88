"""Base class of the registration methods: a method is a rule that weighs the pairs of a matching.

A new method is a subclass of ``PairWeighting`` in its own file, listed in ``pipeline.config.METHODS``.
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
"""Ratio of the standard deviation of a normal distribution to its median absolute deviation."""


@dataclass(frozen=True, slots=True)
class PairWeights:
    """The pairs that a method keeps, and their weights."""

    rows: IntArray
    """(M,) kept rows of the matching."""
    weights: FloatArray
    """(M,) non-negative, summing to one (empty when nothing is kept)."""
    sigma_m: float = float("nan")
    """Scale of the weight function; NaN for methods without one."""
    entropy_nat: float = float("nan")
    """Entropy of the matching; NaN for methods without probabilities."""
    gate_m: float = float("inf")
    """Distance beyond which no pair was kept, if it is computed from the distances; else infinite."""
    energy: float = float("nan")
    """Energy at this pose that an accelerated method minimises; NaN for all others."""


@dataclass(frozen=True, slots=True)
class PairWeighting(ABC):
    """A method in the state of one iteration; subclasses must define the weights only."""

    direction: ClassVar[Direction | None] = None
    """Direction that the method requires; None for the configured one."""
    accelerated: ClassVar[bool] = False
    """Whether Anderson acceleration extrapolates the poses."""
    facing: ClassVar[bool] = False
    """Whether matchings with the plane metric have the pairs' normals, by which the method may weigh them."""

    @classmethod
    def starting(cls, config: RegistrationConfig, source: PointCloud, target: PointCloud) -> PairWeighting:
        """Return the method in the state of its first iteration.

        Args:
            config: the method's parameters.
            source: the thinned cloud that moves.
            target: the thinned cloud that stays.

        Raises:
            InputError: the clouds lack a column that the method needs.
        """
        return cls()

    @abstractmethod
    def weigh(self, matching: Matching) -> PairWeights:
        """Choose the pairs to keep and compute their weights."""

    @property
    def gate_m(self) -> float:
        """Distance beyond which no pair counts; known before the search, it makes the search faster."""
        return float("inf")

    @property
    def settled(self) -> bool:
        """Whether the schedule is complete, so that a small update means convergence."""
        return True

    @property
    def tolerance(self) -> float:
        """Factor on the tolerances of the stop rule in this state."""
        return 1.0

    @property
    def source_share(self) -> float:
        """Share of the source's points that this iteration uses; the same share gives the same points."""
        return 1.0

    @property
    def target_share(self) -> float:
        """Share of the target's points that this iteration uses; the same share gives the same points."""
        return 1.0

    @property
    def neighbours(self) -> int:
        """Number of nearest points paired with each point; a matching has them in blocks, nearest first."""
        return 1

    @property
    def unweighted_centroids(self) -> bool:
        """Whether the point residual uses unweighted centroids of the kept pairs, as in eq. 3.12."""
        return False

    def features(self, cloud: PointCloud) -> FloatArray | None:
        """Return (N, k) further coordinates for the neighbour search after x, y, z, in metres, or None."""
        return None

    def following(self, kept: PairWeights, still: bool) -> PairWeighting:
        """Return the method in the state of the next iteration.

        Args:
            kept: pairs and weights of this state.
            still: whether the stop rule was fulfilled at this iteration.
        """
        return self

    def widened(self) -> PairWeighting | None:
        """Return a wider state to try when too few pairs are kept, or None."""
        return None


def evenly(rows: IntArray) -> PairWeights:
    """Keep the pairs at (K,) ``rows``, all with the same weight."""
    return PairWeights(rows, np.full(len(rows), 1.0 / max(len(rows), 1)))


def closest_rows(distances_m: FloatArray, share: float) -> IntArray:
    """Return (K,) ascending rows of the smallest ``share`` (rounded up) of (M,) distances."""
    count = int(np.ceil(share * len(distances_m) - 1e-9))
    return np.sort(np.argsort(distances_m, kind="stable")[:count])
