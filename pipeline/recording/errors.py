"""Errors of a trajectory against another one (Sturm et al., IROS 2012)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pipeline.registration.residual import DegenerateError, weighted_procrustes
from pipeline.types import FloatArray


def ate_m(T_world_camera: Sequence[FloatArray | None], T_reference_camera: Sequence[FloatArray]) -> float:
    """Return the absolute trajectory error: the RMSE of the positions after rigid alignment (Umeyama 1991).

    Args:
        T_world_camera: (4, 4) poses; None where there is none, which does not count.
        T_reference_camera: as many poses in another world.

    Returns:
        Metres; NaN for fewer than three positions, or positions on one line.
    """
    known = [k for k, T in enumerate(T_world_camera) if T is not None]
    own_m = np.array([T[:3, 3] for T in T_world_camera if T is not None]).reshape(-1, 3)
    other_m = np.array([T_reference_camera[k][:3, 3] for k in known]).reshape(-1, 3)
    if len(known) < 3:
        return float("nan")
    try:
        T = weighted_procrustes(own_m, other_m, np.ones(len(known)))
    except DegenerateError:
        return float("nan")
    apart_m = own_m @ T[:3, :3].T + T[:3, 3] - other_m
    return float(np.sqrt(np.mean(np.sum(apart_m**2, axis=1))))
