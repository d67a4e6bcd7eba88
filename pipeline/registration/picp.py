"""Picky ICP: coarse to fine, with distant pairs rejected and one-to-one matches (SPEC 4.6)."""

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
        """Return the first state, at the coarsest level that the source allows."""
        level = coarsest_level(len(source), cls.thinning, LEVELS)
        return cls(level, max(1, config.max_iterations // LEVELS))

    def weigh(self, matching: Matching) -> PairWeights:
        """Keep pairs up to median + 2.5 robust sigmas, and of pairs that share a point the closest."""
        distances_m = matching.distances_m
        median_m = np.median(distances_m)
        spread_m = MAD_TO_SIGMA * np.median(np.abs(distances_m - median_m))
        rows = np.flatnonzero(distances_m <= median_m + REJECTION_SCALE * spread_m)
        rows = rows[closest_of_each(matching.target_rows[rows], distances_m[rows])]
        rows = rows[closest_of_each(matching.source_rows[rows], distances_m[rows])]
        return evenly(rows)

    @property
    def tolerance(self) -> float:
        """Factor (l + 1)^2 on the tolerances at level l."""
        return float(self.level + 1) ** 2


def closest_of_each(points: IntArray, distances_m: FloatArray) -> IntArray:
    """Return (K,) rows of the closest pair of each distinct point in ``points`` (M,)."""
    by_distance = np.argsort(distances_m, kind="stable")
    _, first = np.unique(points[by_distance], return_index=True)
    return np.sort(by_distance[first])
