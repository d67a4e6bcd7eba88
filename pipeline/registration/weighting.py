"""What a registration method is: a rule that weighs the pairs of a matching.

A new method is a subclass of ``PairWeighting`` in a file of its own, entered in ``methods.WEIGHTINGS``.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass

from pipeline.registration.matching import Matching
from pipeline.types import FloatArray, IntArray


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


@dataclass(frozen=True, slots=True)
class PairWeighting(ABC):
    """A method in the state of one iteration; plain defaults for all but the weights."""

    @abstractmethod
    def weigh(self, matching: Matching) -> PairWeights:
        """Which pairs count, and how much."""

    @property
    def gate_m(self) -> float:
        """Distance beyond which no pair counts."""
        return float("inf")

    @property
    def settled(self) -> bool:
        """Whether the schedule has reached its end, so that a small update means convergence."""
        return True

    def following(self) -> PairWeighting:
        """The method in the state of the next iteration."""
        return self

    def widened(self) -> PairWeighting | None:
        """A wider state to try when too few pairs are kept, or None."""
        return None
