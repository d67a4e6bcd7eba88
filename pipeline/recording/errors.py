"""Errors of a trajectory against another one (Sturm et al., IROS 2012)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pipeline.registration.residual import DegenerateError, weighted_procrustes
from pipeline.types import FloatArray


def path_note(
    T_world_camera: Sequence[FloatArray | None], T_reference_camera: Sequence[FloatArray | None], of: str
) -> tuple[str, ...]:
    """Return a sentence with the ``ate_m`` of a path against a reference called ``of``; none if it is NaN."""
    apart_m = ate_m(T_world_camera, T_reference_camera)
    if np.isnan(apart_m):
        return ()
    return (f"The path differs from {of} by {100.0 * apart_m:.1f} cm (RMSE, aligned)",)


def ate_m(
    T_world_camera: Sequence[FloatArray | None], T_reference_camera: Sequence[FloatArray | None]
) -> float:
    """Return the absolute trajectory error: the RMSE of the positions after rigid alignment (Umeyama 1991).

    Args:
        T_world_camera: (4, 4) poses; None for frames without a pose, which are skipped.
        T_reference_camera: as many poses in another world, or None.

    Returns:
        Metres; NaN for fewer than three positions, or positions on one line.
    """
    pairs = zip(T_world_camera, T_reference_camera, strict=True)
    both = [(T[:3, 3], R[:3, 3]) for T, R in pairs if T is not None and R is not None]
    if len(both) < 3:
        return float("nan")
    own_m, other_m = np.array(both).transpose(1, 0, 2)
    try:
        T = weighted_procrustes(own_m, other_m, np.ones(len(both)))
    except DegenerateError:
        return float("nan")
    apart_m = own_m @ T[:3, :3].T + T[:3, 3] - other_m
    return float(np.sqrt(np.mean(np.sum(apart_m**2, axis=1))))
