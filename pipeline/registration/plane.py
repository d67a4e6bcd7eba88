"""One step towards the target's tangent planes (SPEC 4.1)."""

from __future__ import annotations

import numpy as np

from pipeline.geometry import rigid, rotation_exp
from pipeline.registration.degenerate import DegenerateError
from pipeline.registration.observability import open_motions
from pipeline.types import FloatArray

_DAMPING = 1e-9
_LARGEST_CONDITION = 1e8


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
