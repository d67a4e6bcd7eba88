"""Rotation to a world with z up, for cameras whose world has other axes."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.spatial.transform import Rotation

from pipeline.kernels.geometry import rigid
from pipeline.types import FloatArray

MOST_TILT_DEG = 35.0
"""Largest angle of the cameras' mean upward direction to +z; beyond it the world is rotated upright."""


def upright(T_world_camera: Sequence[FloatArray]) -> FloatArray | None:
    """Return the (4, 4) rotation that makes the cameras' mean upward direction +z; None if z is already up.

    Many recordings use the first camera's axes as world axes, but a rig's world has z up.

    Args:
        T_world_camera: (4, 4) poses; without any, the result is None.
    """
    if not T_world_camera:
        return None
    up = -np.mean([T[:3, 1] for T in T_world_camera], axis=0)
    if up[2] >= np.cos(np.deg2rad(MOST_TILT_DEG)) * np.linalg.norm(up):
        return None
    turn, _ = Rotation.align_vectors([[0.0, 0.0, 1.0]], [up])
    return rigid(turn.as_matrix(), np.zeros(3))
