"""Registrations as edges of a pose graph, with the information that their pairs give about each motion."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pipeline.registration.observability import OPEN_SHARE
from pipeline.types import FloatArray, RegistrationResult

FLOOR_M = 0.001
"""Smallest standard error of a registration with any number of pairs: of the shift, and of the displacement
that the turn causes at the pairs' root mean square distance from their centre."""
SLACK_RAD, SLACK_M = 0.003, 0.006
"""Further error of a right registration, from the sensors' bias and wrong pairs, which loop tests allow for:
three edges close within 5 cm (a right registration has up to 2 cm, SPEC 4.7)."""
WEAK_SHARE = 1e-4
"""Replaces ``OPEN_SHARE`` for the standard errors of measures: in rendered rooms, motions with a share from
2e-4 to 2e-3 are right to millimetres, and noise alone gives 2e-5; ``python -m lab.measuring poses`` prints
how often poses are inside their ellipsoids, for several shares."""
OPEN_M = 1.0
"""Standard error given to a motion that the pairs do not determine at all."""


@dataclass(frozen=True, slots=True)
class PoseEdge:
    """A registration as evidence for the relative pose of two nodes."""

    source: int
    target: int
    T_target_source: FloatArray
    """(4, 4) registered pose X."""
    information: FloatArray
    """(6, 6) inverse covariance of the error of X: the motion (turn in rad, then shift in m) in the source's
    frame with which X exp(motion) is the true pose."""
    strength: float = 1.0
    """Weight of the evidence, above 0: where edges contradict each other, the larger sum of weights stays."""
    agrees: bool = True
    """False for an edge that other evidence contradicts: it determines no pose and checks no loop."""
    weak_information: FloatArray | None = None
    """(6, 6) information with ``WEAK_SHARE``, for standard errors; None: ``information``."""

    @property
    def loop_covariance(self) -> FloatArray:
        """(6, 6) covariance of the motion with the slack that loops allow."""
        return np.linalg.inv(self.information) + np.diag([SLACK_RAD**2] * 3 + [SLACK_M**2] * 3)


def registration_information(
    result: RegistrationResult,
    source_m: FloatArray,
    source_normals: FloatArray,
    target_normals: FloatArray,
    open_share: float = OPEN_SHARE,
) -> FloatArray:
    """Compute an edge's information from the normal matrix of its registration's last pairs.

    The covariance is that of least squares on the point-to-plane distances, s^2 (J^T W J)^-1 / n with n
    effective pairs and the registration's last objective s^2, plus ``FLOOR_M`` squared. One J has the
    source's normals and the other the target's: their noise is independent and cancels, while the square of
    one normal's noise would seem to determine every motion. The share ``open_share`` of the largest
    eigenvalue is subtracted from all of them, so a corridor does not determine the motion along itself.

    Args:
        result: a registration with at least one step.
        source_m: (N, 3) source points, to which the pairs refer, in the source's frame.
        source_normals: (N, 3) their unit normals.
        target_normals: (M, 3) unit normals of the target's points, in the target's frame.
        open_share: share of the best determined motion below which a motion is open.

    Returns:
        (6, 6) information as in ``PoseEdge``.
    """
    last = result.steps[-1]
    points_m = source_m[last.pairs[:, 0]]
    normals = source_normals[last.pairs[:, 0]]
    others = target_normals[last.pairs[:, 1]] @ result.T_target_source[:3, :3]
    others = others * np.where(np.einsum("mi,mi->m", normals, others) < 0.0, -1.0, 1.0)[:, None]
    weights = last.weights / last.weights.sum()
    center_m = weights @ points_m
    arms_m = points_m - center_m
    spread_m = max(float(np.sqrt(weights @ np.sum(arms_m**2, axis=1))), FLOOR_M)
    by_source, by_target = (
        np.concatenate([np.cross(arms_m / spread_m, each), each], axis=1) for each in (normals, others)
    )
    matrix = (by_source * weights[:, None]).T @ by_target
    values, motions = np.linalg.eigh(0.5 * (matrix + matrix.T))
    held = np.maximum(values - open_share * values[-1], 0.0)
    mean_squared_m2 = max(last.objective, FLOOR_M**2)
    with np.errstate(divide="ignore"):
        variances_m2 = np.minimum(mean_squared_m2 / (last.effective_pairs * held), OPEN_M**2)
    covariance_m2 = (motions * variances_m2) @ motions.T + FLOOR_M**2 * np.eye(6)
    about_center = np.eye(6)
    about_center[:3, :3] *= spread_m
    about_center[3:, :3] = -cross_matrix(center_m)
    return about_center.T @ np.linalg.inv(covariance_m2) @ about_center


def cross_matrix(vector: FloatArray) -> FloatArray:
    """Return (..., 3, 3) matrices [v] with [v] w = v x w, of (..., 3) vectors."""
    x, y, z = np.moveaxis(np.asarray(vector, float), -1, 0)
    zero = np.zeros_like(x)
    rows = np.stack([zero, -z, y, z, zero, -x, -y, x, zero], axis=-1)
    return rows.reshape(*rows.shape[:-1], 3, 3)


def adjoint(T_a_b: FloatArray) -> FloatArray:
    """Return the (..., 6, 6) matrices that take small motions (turn, shift) from frame b to frame a."""
    rotation = T_a_b[..., :3, :3]
    matrix = np.zeros((*T_a_b.shape[:-2], 6, 6))
    matrix[..., :3, :3] = matrix[..., 3:, 3:] = rotation
    matrix[..., 3:, :3] = cross_matrix(T_a_b[..., :3, 3]) @ rotation
    return matrix


def small_motion(T: FloatArray) -> FloatArray:
    """Return the (..., 6) turn vector, rad, and shift, m, of rigid (..., 4, 4) motions; exact to first order
    in the shift, and for turns below 180 degrees.
    """
    rotation = T[..., :3, :3]
    skew = 0.5 * (rotation - np.swapaxes(rotation, -1, -2))
    axis = np.stack([skew[..., 2, 1], skew[..., 0, 2], skew[..., 1, 0]], axis=-1)
    sine = np.linalg.norm(axis, axis=-1)
    angle = np.arctan2(sine, 0.5 * (np.trace(rotation, axis1=-2, axis2=-1) - 1.0))
    ratio = np.where(sine > 1e-12, angle / np.maximum(sine, 1e-12), 1.0)
    return np.concatenate([axis * ratio[..., None], T[..., :3, 3]], axis=-1)
