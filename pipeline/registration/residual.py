"""The two residuals of a pair, and the motions that make them least (SPEC 4.1).

Point to point, and point to the target's tangent plane.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from packetmesh.errors import ReconstructionError
from pipeline.config import RegistrationConfig
from pipeline.geometry import apply, rigid, rotation_exp
from pipeline.registration.matching import Matching
from pipeline.registration.neighbourhood import pca_normals
from pipeline.registration.observability import open_motions
from pipeline.types import FloatArray, PointCloud

_SMALLEST_SINGULAR_RATIO = 1e-9
_DAMPING = 1e-9
_LARGEST_CONDITION = 1e8


class DegenerateError(ReconstructionError):
    """The pairs leave the motion undetermined; the message gives the reason in a few words."""


@dataclass(frozen=True, slots=True)
class PointResidual:
    """The vector between the two points of a pair; ``PlaneResidual`` has the same two functions."""

    with_scale: bool
    unweighted_centroids: bool = False
    """Plain centroids, as in eq. 3.12, which do not minimise the weighted error."""

    def solve(self, pairs: Matching, weights: FloatArray) -> FloatArray:
        """The (4, 4) motion, to follow the present pose: the exact minimum, but for plain centroids."""
        return weighted_procrustes(
            pairs.moved_m, pairs.target_m, weights, self.with_scale, self.unweighted_centroids
        )

    def squared_m2(self, pairs: Matching, motion: FloatArray) -> FloatArray:
        """(M,) squared distances after a motion."""
        return np.sum((apply(motion, pairs.moved_m) - pairs.target_m) ** 2, axis=1)


@dataclass(frozen=True, slots=True)
class PlaneResidual:
    """The distance of the source point from the plane through the target point."""

    normals: FloatArray
    """(N, 3) unit normals of the thinned target."""

    def solve(self, pairs: Matching, weights: FloatArray) -> FloatArray:
        """The (4, 4) motion, to follow the present pose: one Gauss-Newton step."""
        return solve_plane(pairs.moved_m, pairs.target_m, self.normals[pairs.target_rows], weights)

    def squared_m2(self, pairs: Matching, motion: FloatArray) -> FloatArray:
        """(M,) squared distances along the normals after a motion."""
        offsets_m = apply(motion, pairs.moved_m) - pairs.target_m
        return np.einsum("mi,mi->m", offsets_m, self.normals[pairs.target_rows]) ** 2


def residual_for(
    config: RegistrationConfig, target: PointCloud, unweighted_centroids: bool = False
) -> PointResidual | PlaneResidual:
    """The configured residual; normals the target does not have are estimated from its points."""
    if config.metric == "point":
        return PointResidual(config.with_scale, unweighted_centroids)
    return PlaneResidual(pca_normals(target.points_m) if target.normals is None else target.normals)


def weighted_procrustes(
    source_m: FloatArray,
    target_m: FloatArray,
    weights: FloatArray,
    with_scale: bool = False,
    unweighted_centroids: bool = False,
) -> FloatArray:
    """The (4, 4) motion that minimises sum w |s R q + t - p|^2 over (M, 3) pairs.

    Corrects eqs. 3.12-3.16 of the thesis: weighted centroids, R = U V^T, and no reflections. With
    ``unweighted_centroids`` the centroids are those of eq. 3.12, and the sum is not at its minimum.

    Raises:
        DegenerateError: the points of one side lie on one line.
    """
    share = (weights / weights.sum())[:, None]
    at = np.full_like(share, 1.0 / len(share)) if unweighted_centroids else share
    source_center_m, target_center_m = (at * source_m).sum(axis=0), (at * target_m).sum(axis=0)
    q, p = source_m - source_center_m, target_m - target_center_m
    covariance = (share * p).T @ q
    U, singular, Vt = np.linalg.svd(covariance)
    if not singular[1] > _SMALLEST_SINGULAR_RATIO * singular[0]:
        raise DegenerateError("the pairs lie on one line, which leaves the rotation about it open")
    signs = np.array([1.0, 1.0, np.sign(np.linalg.det(U @ Vt))])
    rotation = (U * signs) @ Vt
    scale = float(singular @ signs / (share * q**2).sum()) if with_scale else 1.0
    return rigid(scale * rotation, target_center_m - scale * rotation @ source_center_m)


def solve_plane(
    source_m: FloatArray, target_m: FloatArray, normals: FloatArray, weights: FloatArray
) -> FloatArray:
    """The (4, 4) rigid step that minimises sum w (n . (q + omega x q + v - p))^2, linear in omega and v.

    Rotation is taken about the pairs' centroid and lengths in units of their spread, so that neither
    the damping nor the condition depends on where the origin is or what a metre is.

    Raises:
        DegenerateError: the planes leave motions free (all parallel, one cylinder, one sphere).
    """
    share = weights / weights.sum()
    center_m = share @ source_m
    arms = source_m - center_m
    spread_m = float(np.sqrt(share @ np.sum(arms**2, axis=1)))
    if spread_m == 0.0:
        raise DegenerateError("all pairs share one point, which leaves the rotation open")
    arms = arms / spread_m
    residuals = np.einsum("mi,mi->m", normals, target_m - source_m) / spread_m
    jacobian = np.concatenate([np.cross(arms, normals), normals], axis=1)
    hessian = (share[:, None] * jacobian).T @ jacobian
    if not np.linalg.cond(hessian) <= _LARGEST_CONDITION:
        motions = open_motions(source_m, normals, 1.0 / _LARGEST_CONDITION) or "some motion"
        raise DegenerateError(f"{motions} changes no distance to the target's surfaces")
    damped = hessian + _DAMPING * np.trace(hessian) / 6.0 * np.eye(6)
    step = np.linalg.solve(damped, jacobian.T @ (share * residuals))
    rotation = rotation_exp(step[:3])
    return rigid(rotation, center_m - rotation @ center_m + spread_m * step[3:])
