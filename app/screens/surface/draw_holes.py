"""The chosen hole in the scene."""

from __future__ import annotations

import numpy as np
import viser

from app.screens.surface.view import HoleView
from pipeline.types import ByteArray, FloatArray

TAPE = ((255, 225, 0), (0, 0, 0))
"""Alternating yellow and black, as on warning tape: visible on any surface and next to red rims."""
THICKNESS_PX = 6.0


class HoleDrawing:
    """The loop of one hole with its number, below a scene node."""

    def __init__(self, scene: viser.SceneApi, below: str) -> None:
        self._scene, self._below = scene, below
        self._frame = scene.add_frame(below, show_axes=False)
        self._handles: list[viser.SceneNodeHandle] = []

    def draw(self, hole: HoleView, name: str, offset_m: FloatArray) -> None:
        """Draw this hole in place of the last; ``offset_m`` is the (3,) offset of its surface."""
        self.clear()
        points, colors = tape(hole.loop_m)
        loop = self._scene.add_line_segments(
            f"{self._below}/loop", points, colors, thickness=THICKNESS_PX, thickness_units="screen"
        )
        label = self._scene.add_label(
            f"{self._below}/name", name, position=hole.center_m, anchor="bottom-center"
        )
        self._handles = [loop, label]
        self._frame.position = offset_m

    def clear(self) -> None:
        """Remove the drawn hole."""
        for handle in self._handles:
            handle.remove()
        self._handles = []


def tape(loop_m: FloatArray) -> tuple[FloatArray, ByteArray]:
    """Return (2 L, 2, 3) segments, two per edge of an (L, 3) closed loop, in alternating colours."""
    middle_m = 0.5 * (loop_m + np.roll(loop_m, -1, axis=0))
    stops_m = np.stack([loop_m, middle_m], axis=1).reshape(-1, 3)
    points = np.stack([stops_m, np.roll(stops_m, -1, axis=0)], axis=1)
    colors = np.tile(np.repeat(np.array(TAPE, np.uint8)[:, None], 2, axis=1), (len(loop_m), 1, 1))
    return points.astype(np.float32), colors
