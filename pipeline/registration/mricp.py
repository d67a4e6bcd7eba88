"""Multi-resolution ICP: plain ICP on a growing number of points of both clouds (SPEC 4.6)."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from pipeline.config import RegistrationConfig
from pipeline.registration.matching import Matching
from pipeline.registration.weighting import PairWeighting, PairWeights, evenly
from pipeline.types import PointCloud

LEVELS = 4
FEWEST_POINTS = 64
"""Least number of points in a level: smaller clouds have fewer levels."""


@dataclass(frozen=True, slots=True)
class CoarseToFine(PairWeighting):
    """A coarse-to-fine schedule: one source point in ``thinning``^l at level l, all of them at level 0.

    The next finer level follows when this one has converged, at the latest after ``most_steps``, so
    that a coarse level that oscillates between two poses leaves iterations for the others.
    """

    thinning: ClassVar[int]
    """Ratio of the number of points in a level to that in the next coarser one."""
    level: int
    """Current level; 0 is the finest."""
    most_steps: int
    """Largest number of iterations at each level above 0."""
    steps: int = 0
    """Number of iterations so far at this level."""

    @property
    def settled(self) -> bool:
        """Whether this is the finest level."""
        return self.level == 0

    @property
    def source_share(self) -> float:
        """Share of the source points: one in ``thinning``^l."""
        return float(self.thinning) ** -self.level

    def following(self, kept: PairWeights, still: bool) -> CoarseToFine:
        """Return the next state, at the next finer level if this one is done."""
        if self.level and (still or self.steps + 1 >= self.most_steps):
            return replace(self, level=self.level - 1, steps=0)
        return replace(self, steps=self.steps + 1)


def coarsest_level(points: int, thinning: int, levels: int) -> int:
    """Return the first level: ``levels`` - 1, or less if that would leave too few points."""
    possible = int(np.log(max(points / FEWEST_POINTS, 1.0)) / np.log(thinning) + 1e-9)
    return min(levels - 1, possible)


@dataclass(frozen=True, slots=True)
class Mricp(CoarseToFine):
    """MRICP: equal weights, both clouds thinned to one point in 4^l at level l.

    Source: Jost, Huegli, "A multi-resolution ICP with heuristic closest point search for fast and
    robust 3D registration of range images", 3DIM 2003. Their heuristic, which searches a point's match
    near the match of the neighbouring pixel, changes only the speed; here a k-d tree is used instead.
    """

    thinning = 4

    @classmethod
    def starting(cls, config: RegistrationConfig, source: PointCloud, target: PointCloud) -> Mricp:
        """Return the first state, at the coarsest level that the smaller cloud allows."""
        level = coarsest_level(min(len(source), len(target)), cls.thinning, LEVELS)
        return cls(level, max(1, config.max_iterations // LEVELS))

    def weigh(self, matching: Matching) -> PairWeights:
        """Keep all pairs of the level, with equal weights."""
        return evenly(np.arange(len(matching.distances_m)))

    @property
    def target_share(self) -> float:
        """Share of the target points: the same as of the source points."""
        return self.source_share

    @property
    def tolerance(self) -> float:
        """Factor on the tolerances: the spacing of the level's points, which grows with 2^l on a surface."""
        return float(np.sqrt(self.thinning)) ** self.level
