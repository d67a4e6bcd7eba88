"""How far the drawn points are from where they belong, at any pose of a race."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from app.drawing.colors import MOST_DISTANCE_M
from pipeline.kernels.geometry import apply
from pipeline.types import ByteArray, FloatArray

REACH_M = 0.5
"""A point without a partner so near counts as so far from it."""


@dataclass(frozen=True, slots=True)
class Distances:
    """From where each point belongs, or from the nearest point of the target where that is not known."""

    points_m: FloatArray
    """(N, 3) source frame."""
    T_home: FloatArray | None
    tree: cKDTree
    """Of the target."""

    def at(self, T_target_source: FloatArray) -> tuple[FloatArray, float]:
        """(N,) distances in metres at a pose, and their median if they are those from partners, else NaN."""
        places_m = apply(T_target_source, self.points_m)
        if self.T_home is not None:
            return np.linalg.norm(places_m - apply(self.T_home, self.points_m), axis=1), float("nan")
        distances_m = self.tree.query(places_m, distance_upper_bound=REACH_M)[0]
        distances_m = np.minimum(distances_m, REACH_M)
        return distances_m, float(np.median(distances_m))


def shades_of(distances_m: FloatArray) -> ByteArray:
    """(N,) 0 to 255 for distances from none to ``MOST_DISTANCE_M`` and beyond."""
    return np.rint(255.0 * np.minimum(distances_m / MOST_DISTANCE_M, 1.0)).astype(np.uint8)
