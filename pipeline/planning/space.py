"""Free space: cells through which a present camera sees, so that a new camera may stand there."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pipeline.planning.views import PresentView, depth_at
from pipeline.types import BoolArray, FloatArray

CELL_M = 0.1
"""Edge of the cells of free space."""
MARGIN_M = 0.5
"""Width of the border of cells around the surface and the cameras."""
STANDS_FREE_M = 0.6
"""Space within this distance of a camera is free: something stands there without being in its own way."""
BEFORE_M = 0.05
"""A cell is free if its middle is at least this far in front of what a camera sees."""


@dataclass(frozen=True, slots=True)
class FreeSpace:
    """Cells of the room's box: free if a camera sees through them."""

    low_m: FloatArray
    """(3,) corner of the first cell."""
    free: BoolArray
    """(X, Y, Z) True for free cells; the others are unknown or filled."""

    def is_free(self, places_m: FloatArray) -> BoolArray:
        """Return (N,) True for (N, 3) places in free cells."""
        cells = np.floor((places_m - self.low_m) / CELL_M).astype(int)
        inside = np.all((cells >= 0) & (cells < self.free.shape), axis=1)
        free = np.zeros(len(places_m), bool)
        free[inside] = self.free[tuple(cells[inside].T)]
        return free


def free_space(vertices_m: FloatArray, views: Sequence[PresentView]) -> FreeSpace:
    """Return the cells that some camera sees through, around a surface with (V, 3) vertices."""
    eyes_m = np.array([view.camera.T_world_camera[:3, 3] for view in views])
    low_m = np.minimum(vertices_m.min(axis=0), eyes_m.min(axis=0)) - MARGIN_M
    high_m = np.maximum(vertices_m.max(axis=0), eyes_m.max(axis=0)) + MARGIN_M
    counts = np.ceil((high_m - low_m) / CELL_M).astype(int)
    axes = [low + CELL_M * (np.arange(count) + 0.5) for low, count in zip(low_m, counts, strict=True)]
    middles_m = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    free = np.zeros(len(middles_m), bool)
    for view, eye_m in zip(views, eyes_m, strict=True):
        depth_m, there_m = depth_at(middles_m, view.camera, view.z_m)
        free |= depth_m < there_m - BEFORE_M
        free |= np.linalg.norm(middles_m - eye_m, axis=1) < STANDS_FREE_M
    return FreeSpace(low_m, free.reshape(tuple(counts)))
