"""Placement of solids in pieces and of pieces in rooms; a piece stands on z = 0, its front towards -y."""

from __future__ import annotations

import numpy as np

from lab.worlds.primitives import Mesh, Vector, box, rounded_box
from lab.worlds.scene import Material, Part
from pipeline.kernels.geometry import rigid, rotation_exp
from pipeline.types import FloatArray

ORIGIN = np.eye(4)
"""Pose of a piece whose frame is that of the world."""


def place(x_m: float, y_m: float, yaw_rad: float = 0.0, z_m: float = 0.0) -> FloatArray:
    """Return T_world_piece at (x, y, z), turned about the vertical; the front looks along -y at yaw 0."""
    return rigid(rotation_exp(np.array([0.0, 0.0, yaw_rad])), np.array([x_m, y_m, z_m]))


def solid(
    mesh: Mesh,
    material: Material,
    T_world: FloatArray,
    at_m: Vector = (0.0, 0.0, 0.0),
    turn_rad: Vector = (0.0, 0.0, 0.0),
    smooth: bool = True,
) -> Part:
    """Return a part, in its piece turned by the rotation vector ``turn_rad`` and then shifted by ``at_m``."""
    T_piece_part = rigid(rotation_exp(np.asarray(turn_rad, float)), np.asarray(at_m, float))
    return Part(*mesh, material, T_world @ T_piece_part, smooth)


def board(
    size_m: Vector,
    material: Material,
    T_world: FloatArray,
    at_m: Vector = (0.0, 0.0, 0.0),
    turn_rad: Vector = (0.0, 0.0, 0.0),
    edge_m: float = 0.0,
) -> Part:
    """A block centred on ``at_m`` of its piece, its edges bevelled by ``edge_m``."""
    mesh = rounded_box(size_m, edge_m, steps=1, cells=1) if edge_m else box(size_m)
    return solid(mesh, material, T_world, at_m, turn_rad, smooth=False)


def corners(x_m: float, y_m: float) -> list[tuple[float, float]]:
    """Return the four corners of a rectangle of half sizes ``x_m`` and ``y_m``, for legs."""
    return [(x, y) for x in (-x_m, x_m) for y in (-y_m, y_m)]
