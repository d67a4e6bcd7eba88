"""One step towards the target's tangent planes (SPEC 4.1)."""

from __future__ import annotations

import numpy as np

from pipeline.geometry import rigid, rotation_exp
from pipeline.registration.degenerate import DegenerateError
from pipeline.types import FloatArray

_DAMPING = 1e-9
_LARGEST_CONDITION = 1e8
_SMALLEST_SHARE_OF_A_MOTION = 0.3
"""Part of a unit motion below which its turn or its slide is left unsaid."""


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
    stiffness, motions = np.linalg.eigh(hessian)
    free = stiffness < stiffness[-1] / _LARGEST_CONDITION
    if free.any():
        raise DegenerateError(f"the target's surfaces leave the source free {free_motions(motions[:, free])}")
    damped = hessian + _DAMPING * np.trace(hessian) / 6.0 * np.eye(6)
    step = np.linalg.solve(damped, jacobian.T @ (share * residuals))
    rotation = rotation_exp(step[:3])
    return rigid(rotation, center_m - rotation @ center_m + spread_m * step[3:])


def free_motions(motions: FloatArray) -> str:
    """What (6, k) undetermined motions (omega, v) do, in words: to turn about and to slide along axes.

    Turns and slides are told apart by the subspaces they span, in the target's frame.
    """
    words = []
    for name, rows in (("to turn about", motions[:3]), ("to slide along", motions[3:])):
        axes, sizes, _ = np.linalg.svd(rows)
        axes = axes[:, : len(sizes)][:, sizes > _SMALLEST_SHARE_OF_A_MOTION]
        if axes.shape[1] == 3:
            words.append(f"{name} any axis")
        else:
            words += [f"{name} {_spelled(axis)}" for axis in axes.T]
    return " and ".join(words)


def _spelled(axis: FloatArray) -> str:
    """An axis as x, y or z if it is one of them, else its three numbers, the largest positive."""
    largest = int(np.argmax(np.abs(axis)))
    if abs(axis[largest]) > 0.999:
        return "xyz"[largest]
    axis = axis * np.sign(axis[largest])
    return "({:.2f}, {:.2f}, {:.2f})".format(*(axis + 0.0))
