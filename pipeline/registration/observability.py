"""Motions that a surface does not determine: sliding along it, turning on it (SPEC 4.1, degenerate cases)."""

from __future__ import annotations

import numpy as np

from pipeline.kernels.geometry import rigid, rotation_exp
from pipeline.types import FloatArray

OPEN_SHARE = 2e-3
"""A motion is open if its squared change of the distances to the planes is below this share of that of the
best determined motion; a noise of the normals by 2 degrees gives 1e-3."""


def open_motions(points_m: FloatArray, normals: FloatArray, open_share: float = OPEN_SHARE) -> str:
    """Name the motions that (N, 3) points with (N, 3) unit normals do not determine; empty if none.

    The 6 x 6 Gauss-Newton matrix of the point-to-plane distances is split: slides are the weak directions of
    its translation block, turns those of the rotation block after elimination of the best translation.
    """
    hessian = _normal_matrix(points_m, normals)
    floor = open_share * float(np.linalg.eigvalsh(hessian)[-1])
    slide_values, slides = np.linalg.eigh(hessian[3:, 3:])
    held = slide_values > floor
    inverse = (slides[:, held] / slide_values[held]) @ slides[:, held].T
    turn_values, turns = np.linalg.eigh(hessian[:3, :3] - hessian[:3, 3:] @ inverse @ hessian[3:, :3])
    parts = [_slides(slides, held), _turns(turns, turn_values > floor)]
    return " and ".join(part for part in parts if part)


def stiffness(points_m: FloatArray, normals: FloatArray) -> float:
    """Return how well (N, 3) points with (N, 3) unit normals hold the motion that they hold least.

    It is the least eigenvalue of the matrix in ``open_motions`` over the largest, 0 to 1: about 0 if a
    motion is open, and 0 for fewer than six points.
    """
    if len(points_m) < 6:
        return 0.0
    values = np.linalg.eigvalsh(_normal_matrix(points_m, normals))
    return max(0.0, float(values[0] / values[-1]))


def weakest_motion(points_m: FloatArray, normals: FloatArray, length_m: float) -> FloatArray:
    """Return the (4, 4) motion that (N, 3) points with (N, 3) unit normals hold least (see ``stiffness``).

    It moves the points by about ``length_m`` (root mean square); ``-length_m`` gives the opposite motion.
    """
    weakest = np.linalg.eigh(_normal_matrix(points_m, normals))[1][:, 0]
    center_m, spread_m = _center_and_spread(points_m)
    turn = rotation_exp(length_m / spread_m * weakest[:3])
    return rigid(turn, center_m - turn @ center_m + length_m * weakest[3:])


def _center_and_spread(points_m: FloatArray) -> tuple[FloatArray, float]:
    """Return the (3,) mean of (N, 3) points, and their root mean square distance from it."""
    center_m = points_m.mean(axis=0)
    arms_m = points_m - center_m
    return center_m, max(float(np.sqrt(np.mean(np.sum(arms_m**2, axis=1)))), np.finfo(float).tiny)


def _normal_matrix(points_m: FloatArray, normals: FloatArray) -> FloatArray:
    """Return the (6, 6) Gauss-Newton matrix about the centre, with lengths in units of the points' spread."""
    center_m, spread_m = _center_and_spread(points_m)
    arms = (points_m - center_m) / spread_m
    jacobian = np.concatenate([np.cross(arms, normals), normals], axis=1)
    return jacobian.T @ jacobian / len(points_m)


def _slides(axes: FloatArray, held: np.ndarray) -> str:
    """Name the open slides; the columns of ``axes`` (3, 3) that are not ``held`` are open."""
    open_count = int((~held).sum())
    if open_count == 3:
        return "sliding anywhere"
    if open_count == 2:
        return f"sliding in any direction perpendicular to {_named(axes[:, held][:, 0])}"
    return f"sliding along {_named(axes[:, ~held][:, 0])}" if open_count else ""


def _turns(axes: FloatArray, held: np.ndarray) -> str:
    open_count = int((~held).sum())
    if open_count == 3:
        return "turning about any axis"
    if open_count == 2:
        return f"turning about any axis perpendicular to {_named(axes[:, held][:, 0])}"
    return f"turning about {_named(axes[:, ~held][:, 0])}" if open_count else ""


def _named(direction: FloatArray) -> str:
    """Return ``x``, ``y`` or ``z`` if the direction is near that axis, else its coordinates."""
    strongest = int(np.argmax(np.abs(direction)))
    if abs(direction[strongest]) > 0.98:
        return "xyz"[strongest]
    x, y, z = np.round(direction * np.sign(direction[strongest]), 2) + 0.0  # + 0.0 turns -0.0 into 0.0
    return f"({x:.2f}, {y:.2f}, {z:.2f})"
