"""What the player of the rolling ball shows; light enough for the serving process."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from app.screens.surface.view import Which
from pipeline.types import ByteArray, FloatArray, IntArray

Happening = Literal["seed", "join", "glue", "end"]
"""A ball was put down on three points, turned onto an unused point or onto one of the front, or came to its
end because no edge is left to turn about."""


@dataclass(frozen=True, slots=True)
class WalkRequest:
    """Which walk to watch."""

    which: Which
    close_up: bool
    """Every pivot on a patch of the cloud; otherwise the whole cloud in batches."""


@dataclass(frozen=True, slots=True)
class WalkView:
    """The walk of one ball, or of several after each other, step by step."""

    request: WalkRequest
    points_m: FloatArray
    """(N, 3) float32."""
    colors: ByteArray | None
    """(N, 3) RGB."""
    triangles: IntArray
    """(F, 3) int32 in the order made."""
    radii_m: tuple[float, ...]
    step_ends: IntArray
    """(S,) int32 triangles after each step."""
    step_radius: ByteArray
    """(S,) which ball rolls."""
    places_m: FloatArray
    """(S, K, 3) float32 where the ball is on its way through each step; the last is where it rests."""
    happenings: tuple[Happening, ...]
    """(S,) of a close-up; empty otherwise."""
    glued_by: IntArray
    """(3 F,) int32 triangle that took a half-edge off the boundary, F for none.

    Half-edge 3 t + k starts at corner k of triangle t.
    """
    left_front: IntArray
    """(R, 3 F) uint16 first step without the half-edge on each ball's front."""
    center_m: FloatArray
    """(3,) middle of what is shown."""
    reach_m: float
    """How far the farthest point is from it."""
    outward: FloatArray
    """(3,) unit vector, the mean of the normals: the side to look from."""

    @property
    def steps(self) -> int:
        """How many there are."""
        return len(self.step_ends)

    @property
    def places(self) -> int:
        """Places of the ball in one step."""
        return self.places_m.shape[1]

    def count(self, done: int) -> int:
        """Triangles after ``done`` steps."""
        return int(self.step_ends[done - 1]) if done else 0

    def open_edges(self, done: int) -> tuple[IntArray, IntArray]:
        """(E, 2) points of the front after ``done`` steps; (D, 2) of edges where the ball found nothing."""
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
        """(2,) points of the edge about which the ball turns in a close-up's step; None for no such edge."""
        if not self.happenings or self.happenings[step] not in ("join", "glue"):
            return None
        return self.triangles[self.count(step), 1::-1]
