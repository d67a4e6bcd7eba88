"""The two residuals of a pair: point to point, and point to the target's tangent plane."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from pipeline.config import RegistrationConfig
from pipeline.geometry import apply
from pipeline.registration.matching import Matching
from pipeline.registration.neighbourhood import pca_normals
from pipeline.registration.plane import solve_plane
from pipeline.registration.procrustes import weighted_procrustes
from pipeline.types import FloatArray, PointCloud


class Residual(Protocol):
    """What the motion of one iteration minimises."""

    def solve(self, pairs: Matching, weights: FloatArray) -> FloatArray:
        """The (4, 4) motion, to follow the present pose, with the least weighted mean square."""
        ...

    def squared_m2(self, pairs: Matching, motion: FloatArray) -> FloatArray:
        """(M,) squared residuals after a motion."""
        ...


@dataclass(frozen=True, slots=True)
class PointResidual:
    """The vector between the two points of a pair."""

    with_scale: bool
    unweighted_centroids: bool = False
    """Plain centroids, as in eq. 3.12, which do not minimise the weighted error."""

    def solve(self, pairs: Matching, weights: FloatArray) -> FloatArray:
        """Weighted Procrustes: the exact minimum, but for plain centroids."""
        return weighted_procrustes(
            pairs.moved_m, pairs.target_m, weights, self.with_scale, self.unweighted_centroids
        )

    def squared_m2(self, pairs: Matching, motion: FloatArray) -> FloatArray:
        """(M,) squared distances."""
        return np.sum((apply(motion, pairs.moved_m) - pairs.target_m) ** 2, axis=1)


@dataclass(frozen=True, slots=True)
class PlaneResidual:
    """The distance of the source point from the plane through the target point."""

    normals: FloatArray
    """(N, 3) unit normals of the thinned target."""

    def solve(self, pairs: Matching, weights: FloatArray) -> FloatArray:
        """One Gauss-Newton step."""
        return solve_plane(pairs.moved_m, pairs.target_m, self.normals[pairs.target_rows], weights)

    def squared_m2(self, pairs: Matching, motion: FloatArray) -> FloatArray:
        """(M,) squared distances along the normals."""
        offsets_m = apply(motion, pairs.moved_m) - pairs.target_m
        return np.einsum("mi,mi->m", offsets_m, self.normals[pairs.target_rows]) ** 2


def residual_for(
    config: RegistrationConfig, target: PointCloud, unweighted_centroids: bool = False
) -> Residual:
    """The configured residual; normals the target does not have are estimated from its points."""
    if config.metric == "point":
        return PointResidual(config.with_scale, unweighted_centroids)
    return PlaneResidual(pca_normals(target.points_m) if target.normals is None else target.normals)
