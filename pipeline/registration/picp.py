"""Picky ICP: coarse to fine, without far pairs and without shared points (SPEC 4.6)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pipeline.config import RegistrationConfig
from pipeline.registration.matching import Matching
from pipeline.registration.mricp import CoarseToFine, coarsest_level
from pipeline.registration.weighting import MAD_TO_SIGMA, PairWeights, evenly
from pipeline.types import FloatArray, IntArray, PointCloud

LEVELS = 5
REJECTION_SCALE = 2.5


@dataclass(frozen=True, slots=True)
class Picp(CoarseToFine):
    """PICP: equal weights for close one-to-one pairs, one source point in 2^l at level l.

    Source: Zinsser, Schmidt, Niemann, "A refined ICP algorithm for robust 3-D correspondence
    estimation", ICIP 2003; the rejection, and its order, as in OpenCV's ``surface_matching/icp.cpp``.
    """

    thinning = 2

    @classmethod
    def starting(cls, config: RegistrationConfig, source: PointCloud, target: PointCloud) -> Picp:
        """At the coarsest level that the source allows."""
        level = coarsest_level(len(source), cls.thinning, LEVELS)
        return cls(level, max(1, config.max_iterations // LEVELS))

    def weigh(self, matching: Matching) -> PairWeights:
        """Without the pairs beyond median + 2.5 robust sigmas; of those that share a point the closest."""
        distances_m = matching.distances_m
        median_m = np.median(distances_m)
        spread_m = MAD_TO_SIGMA * np.median(np.abs(distances_m - median_m))
        rows = np.flatnonzero(distances_m <= median_m + REJECTION_SCALE * spread_m)
        rows = rows[closest_of_each(matching.target_rows[rows], distances_m[rows])]
        rows = rows[closest_of_each(matching.source_rows[rows], distances_m[rows])]
        return evenly(rows)

    @property
    def tolerance(self) -> float:
        """Looser at coarse levels, by (l + 1)^2."""
        return float(self.level + 1) ** 2


def closest_of_each(points: IntArray, distances_m: FloatArray) -> IntArray:
    """(K,) rows that keep, of the pairs with the same (M,) point, only the closest."""
    by_distance = np.argsort(distances_m, kind="stable")
    _, first = np.unique(points[by_distance], return_index=True)
    return np.sort(by_distance[first])
