"""Errors of a trajectory against another one (Sturm et al., IROS 2012)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pipeline.registration.residual import DegenerateError, weighted_procrustes
from pipeline.types import FloatArray


def ate_m(T_world_camera: Sequence[FloatArray | None], T_reference_camera: Sequence[FloatArray]) -> float:
    """Return the absolute trajectory error: the RMSE of the positions after rigid alignment (Umeyama 1991).

    Args:
        T_world_camera: (4, 4) poses; None for frames without a pose, which are skipped.
        T_reference_camera: as many poses in another world.

    Returns:
        Metres; NaN for fewer than three positions, or positions on one line.
    """
    both = [(T, R) for T, R in zip(T_world_camera, T_reference_camera, strict=True) if T is not None]
    if len(both) < 3:
        return float("nan")
    own_m, other_m = (np.array([pair[k][:3, 3] for pair in both]) for k in range(2))
    try:
        T = weighted_procrustes(own_m, other_m, np.ones(len(both)))
    except DegenerateError:
        return float("nan")
    apart_m = own_m @ T[:3, :3].T + T[:3, 3] - other_m
    return float(np.sqrt(np.mean(np.sum(apart_m**2, axis=1))))
