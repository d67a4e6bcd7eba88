"""The best rigid or similarity motion between paired points, in closed form (SPEC 4.1)."""

from __future__ import annotations

import numpy as np

from pipeline.geometry import rigid
from pipeline.registration.degenerate import DegenerateError
from pipeline.types import FloatArray

_SMALLEST_SINGULAR_RATIO = 1e-9


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
