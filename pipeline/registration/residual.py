"""The two residuals of a pair, and the motions that minimise them (SPEC 4.1).

They are point-to-point, and point-to-plane with the target's tangent plane.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from packetmesh.errors import ReconstructionError
from pipeline.config import RegistrationConfig
from pipeline.kernels.geometry import apply, rigid
from pipeline.kernels.kdtree import compiled, squared_distance
from pipeline.registration.matching import Matches, Matching
from pipeline.registration.neighbourhood import Normals
from pipeline.registration.observability import open_motions
from pipeline.types import FloatArray, IntArray

_SMALLEST_SINGULAR_RATIO = 1e-9
_DAMPING = 1e-9
_LARGEST_CONDITION = 1e8


class DegenerateError(ReconstructionError):
    """The pairs leave the motion undetermined; the message gives the reason in a few words."""


@dataclass(frozen=True, slots=True)
class PointResidual:
    """Point-to-point residual; ``PlaneResidual`` has the same two functions."""

    with_scale: bool
    unweighted_centroids: bool = False
    """True for unweighted centroids, as in eq. 3.12, which do not minimise the weighted error."""

    def solve(self, pairs: Matching, weights: FloatArray) -> FloatArray:
        """Return the (4, 4) motion to apply after the current pose; the minimum for weighted centroids."""
        return weighted_procrustes(
            pairs.moved_m, pairs.target_m, weights, self.with_scale, self.unweighted_centroids
        )

    def mean_squared_m2(self, pairs: Matching, weights: FloatArray, motion: FloatArray) -> float:
        """Return the weighted mean squared distance after a motion."""
        apart_m = apply(motion, pairs.moved_m) - pairs.target_m
        return float(np.einsum("m,mi,mi->", weights, apart_m, apart_m))


@dataclass(frozen=True, slots=True)
class PlaneResidual:
    """Point-to-plane residual: distance of the source point from the plane through the target point.

    The plane's normal is the mean of both points' normals where the pairs have it (the symmetric objective of
    Rusinkiewicz 2019), else the target's.
    """

    target_normals: Normals
    """Normals of the thinned target."""

    def solve(self, pairs: Matching, weights: FloatArray) -> FloatArray:
        """Return the (4, 4) motion to apply after the current pose: one Gauss-Newton step."""
        normals, rows = self._planes(pairs)
        return solve_plane(pairs.moved_m, pairs.target_m, normals, weights, rows)

    def mean_squared_m2(self, pairs: Matching, weights: FloatArray, motion: FloatArray) -> float:
        """Return the weighted mean squared distance along the normals after a motion."""
        normals, rows = self._planes(pairs)
        return float(_mean_squared_height(pairs.moved_m, pairs.target_m, normals, rows, weights, motion))

    def _planes(self, pairs: Matching) -> tuple[FloatArray, IntArray]:
        """Return (N, 3) normals, and each pair's row among them."""
        if pairs.normals is not None:
            return pairs.normals, np.arange(len(pairs.normals))
        return self.target_normals.all, pairs.target_rows


def residual_for(
    config: RegistrationConfig, matcher: Matches, unweighted_centroids: bool = False
) -> PointResidual | PlaneResidual:
    """Create the configured residual; a target without normals gets them from its points."""
    if config.metric == "point":
        return PointResidual(config.with_scale, unweighted_centroids)
    return PlaneResidual(matcher.target_normals)


def weighted_procrustes(
    source_m: FloatArray,
    target_m: FloatArray,
    weights: FloatArray,
    with_scale: bool = False,
    unweighted_centroids: bool = False,
) -> FloatArray:
    """Compute the (4, 4) motion that minimises sum w |s R q + t - p|^2 over (M, 3) pairs.

    It corrects eqs. 3.12-3.16 of the thesis: weighted centroids, R = U V^T, and no reflections. With
    ``unweighted_centroids`` the centroids are those of eq. 3.12, and the sum is not at its minimum.

    Raises:
        DegenerateError: the points of one cloud are collinear.
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
    source_m: FloatArray,
    target_m: FloatArray,
    normals: FloatArray,
    weights: FloatArray,
    normal_rows: IntArray | None = None,
) -> FloatArray:
    """Compute the (4, 4) rigid step that minimises sum w (n . (q + omega x q + v - p))^2 (linearised).

    The rotation is about the pairs' centroid and lengths are in units of their spread, so that damping
    and condition depend neither on the origin nor on the unit of length.

    Args:
        source_m: (M, 3) points q.
        target_m: (M, 3) points p.
        normals: (N, 3) unit normals n.
        weights: (M,) weights of the pairs.
        normal_rows: (M,) each pair's row of ``normals``; None if they are in the pairs' order.

    Raises:
        DegenerateError: the planes leave motions undetermined (all parallel, one cylinder, one sphere).
    """
    rows = np.arange(len(normals)) if normal_rows is None else normal_rows
    motion, spread_m, values = _plane_step(source_m, target_m, normals, rows, weights)
    if spread_m == 0.0:
        raise DegenerateError("all pairs share one point, which leaves the rotation open")
    if not values[-1] <= _LARGEST_CONDITION * values[0]:
        motions = open_motions(source_m, normals[rows], 1.0 / _LARGEST_CONDITION) or "some motion"
        raise DegenerateError(f"{motions} changes no distance to the target's surfaces")
    return motion


@compiled
def _plane_step(
    source: FloatArray, target: FloatArray, normals: FloatArray, rows: IntArray, weights: FloatArray
) -> tuple[FloatArray, float, FloatArray]:
    """Return ``solve_plane``'s (4, 4) motion, the pairs' spread, and the eigenvalues of the step's matrix."""
    motion = np.eye(4)
    center, spread, hessian, gradient = _normal_equations(source, target, normals, rows, weights)
    if spread == 0.0:
        return motion, spread, gradient
    values, vectors = np.linalg.eigh(hessian)
    step, damping = np.zeros(6), _DAMPING * values.mean()
    for a in range(6):
        along = 0.0
        for b in range(6):
            along += vectors[b, a] * gradient[b]
        for b in range(6):
            step[b] += vectors[b, a] * along / (values[a] + damping)
    rotation = _rotation(step[0], step[1], step[2])
    for a in range(3):
        motion[a, 3] = center[a] + spread * step[3 + a]
        for b in range(3):
            motion[a, b] = rotation[a, b]
            motion[a, 3] -= rotation[a, b] * center[b]
    return motion, spread, values


@compiled
def _rotation(x: float, y: float, z: float) -> FloatArray:
    """Compute ``geometry.rotation_exp`` in compiled code."""
    angle = np.sqrt(x * x + y * y + z * z)
    across = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    sine = np.sin(angle) / angle if angle > 0.0 else 1.0
    half = np.sin(0.5 * angle) / (0.5 * angle) if angle > 0.0 else 1.0
    rotation = np.eye(3)
    for a in range(3):
        for b in range(3):
            rotation[a, b] += sine * across[a, b]
            for k in range(3):
                rotation[a, b] += 0.5 * half * half * across[a, k] * across[k, b]
    return rotation


@compiled
def _normal_equations(
    source: FloatArray, target: FloatArray, normals: FloatArray, rows: IntArray, weights: FloatArray
) -> tuple[FloatArray, float, FloatArray, FloatArray]:
    """Return the pairs' weighted centre, their spread, the (6, 6) matrix and the (6,) right-hand side."""
    center, total = np.zeros(3), 0.0
    for m in range(len(weights)):
        total += weights[m]
        for k in range(3):
            center[k] += weights[m] * source[m, k]
    center /= total
    spread = 0.0
    for m in range(len(weights)):
        spread += weights[m] * squared_distance(source[m], center)
    spread = np.sqrt(spread / total)
    upper, gradient = np.zeros((6, 6)), np.zeros(6)
    if spread == 0.0:
        return center, spread, upper, gradient
    row = np.empty(6)
    for m in range(len(weights)):
        nx, ny, nz = normals[rows[m], 0], normals[rows[m], 1], normals[rows[m], 2]
        x, y, z = source[m, 0], source[m, 1], source[m, 2]
        height = nx * (target[m, 0] - x) + ny * (target[m, 1] - y) + nz * (target[m, 2] - z)
        x, y, z = (x - center[0]) / spread, (y - center[1]) / spread, (z - center[2]) / spread
        row[0], row[1], row[2] = y * nz - z * ny, z * nx - x * nz, x * ny - y * nx
        row[3], row[4], row[5] = nx, ny, nz
        share = weights[m] / total
        for a in range(6):
            weighed = share * row[a]
            gradient[a] += weighed * height / spread
            for b in range(a, 6):
                upper[a, b] += weighed * row[b]
    for a in range(6):
        for b in range(a):
            upper[a, b] = upper[b, a]
    return center, spread, upper, gradient


@compiled
def _mean_squared_height(
    source: FloatArray,
    target: FloatArray,
    normals: FloatArray,
    rows: IntArray,
    weights: FloatArray,
    motion: FloatArray,
) -> float:
    """Return the mean squared distance of moved points to their partners' planes; weights sum to one."""
    mean = 0.0
    for m in range(len(rows)):
        height = 0.0
        for k in range(3):
            moved = motion[k, 3]
            for j in range(3):
                moved += motion[k, j] * source[m, j]
            height += normals[rows[m], k] * (moved - target[m, k])
        mean += weights[m] * height * height
    return mean
