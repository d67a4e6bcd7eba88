"""A recorded walk of the rolling ball, with imports light enough for the server process."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from app.screens.surface.view import Which
from pipeline.types import ByteArray, FloatArray, IntArray

Happening = Literal["seed", "join", "glue", "end"]
"""The ball was put on three points (seed), pivoted onto an unused point (join) or onto one of the front
(glue), or stopped because no edge is left to pivot about (end)."""


@dataclass(frozen=True, slots=True)
class WalkRequest:
    """The walk to record."""

    which: Which
    close_up: bool
    """True records every pivot on a patch of the cloud; False the whole cloud, several pivots per step."""


@dataclass(frozen=True, slots=True)
class WalkView:
    """The walk of one ball, or of several in sequence, step by step."""

    request: WalkRequest
    points_m: FloatArray
    """(N, 3) float32."""
    colors: ByteArray | None
    """(N, 3) RGB."""
    triangles: IntArray
    """(F, 3) int32 in the order in which they were made."""
    radii_m: tuple[float, ...]
    step_ends: IntArray
    """(S,) int32 number of triangles after each step."""
    step_radius: ByteArray
    """(S,) index of the rolling ball."""
    places_m: FloatArray
    """(S, K, 3) float32 positions of the ball during each step; the last is its rest position."""
    happenings: tuple[Happening, ...]
    """(S,) events of a close-up; empty otherwise."""
    glued_by: IntArray
    """(3 F,) int32 triangle that removed a half-edge from the boundary, F for none.

    Half-edge 3 t + k starts at corner k of triangle t.
    """
    left_front: IntArray
    """(R, 3 F) uint16 first step at which the half-edge has left each ball's front."""
    center_m: FloatArray
    """(3,) median of the points."""
    reach_m: float
    """Distance of the farthest point from the middle."""
    outward: FloatArray
    """(3,) unit vector, the mean of the normals: the side to look from."""

    @property
    def steps(self) -> int:
        """Number of steps."""
        return len(self.step_ends)

    @property
    def places(self) -> int:
        """Positions of the ball in one step."""
        return self.places_m.shape[1]

    def count(self, done: int) -> int:
        """Return the number of triangles after ``done`` steps."""
        return int(self.step_ends[done - 1]) if done else 0

    def open_edges(self, done: int) -> tuple[IntArray, IntArray]:
        """Return (E, 2) points of the front's edges after ``done`` steps; (D, 2) of edges without a hit."""
        count = self.count(done)
        unglued = np.flatnonzero(self.glued_by[: 3 * count] >= count)
        on_front = self.left_front[self.step_radius[done - 1], unglued] >= done
        corner = unglued % 3
        ends = np.stack(
            [
                self.triangles.reshape(-1)[unglued],
                self.triangles.reshape(-1)[unglued - corner + (corner + 1) % 3],
            ],
            axis=1,
        )
        return ends[on_front], ends[~on_front]

    def pivot(self, step: int) -> IntArray | None:
        """Return (2,) point indices of the edge about which the ball pivots in a close-up's step, or None."""
        if not self.happenings or self.happenings[step] not in ("join", "glue"):
            return None
        return self.triangles[self.count(step), 1::-1]
