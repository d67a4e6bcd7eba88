"""Surfaces before and after fusion, their holes as red loops."""

from __future__ import annotations

import numpy as np
import viser

from app.drawing.colors import LOSS
from app.jobs.records import MeshView, PaintedMesh
from pipeline.types import FloatArray


class SurfaceDrawing:
    """One mesh and its boundary loops below a scene node."""

    def __init__(self, scene: viser.SceneApi, below: str, label: str) -> None:
        self._scene, self._below, self._label = scene, below, label
        self._meshes: list[viser.GlbHandle] = []
        self._made = 0
        self._loops: viser.LineSegmentsHandle | None = None
        self._loops_shown = True
        self._frame = scene.add_frame(below, show_axes=False)

    def draw(self, view: MeshView | PaintedMesh) -> None:
        """Draw this one; ``drop_old`` then takes the one before away.

        A browser needs some frames to read a mesh. The one before stays until then, so that the
        surface does not blink while the radius is dragged.
        """
        self._made += 1
        if view.glb:
            self._meshes.append(self._scene.add_glb(f"{self._below}/mesh-{self._made}", view.glb))
        else:
            self.drop_old(keep=0)
        if self._loops is not None:
            self._loops.remove()
        self._loops = None
        if len(view.rims_m):
            self._loops = self._scene.add_line_segments(
                f"{self._below}/loops",
                view.rims_m,
                np.array(LOSS),
                thickness=1.5,
                thickness_units="screen",
                visible=self._loops_shown,
            )

    def drop_old(self, keep: int = 1) -> None:
        """Remove all meshes but the last."""
        while len(self._meshes) > keep:
            self._meshes.pop(0).remove()

    def clear(self) -> None:
        """Draw nothing."""
        self.drop_old(keep=0)
        if self._loops is not None:
            self._loops.remove()
        self._loops = None

    def show(self, visible: bool, loops: bool, offset_m: FloatArray, top_m: FloatArray | None) -> None:
        """Whether and where to show it; a label at ``top_m`` tells two apart."""
        self._frame.visible = visible
        self._frame.position = offset_m
        self._loops_shown = loops
        if self._loops is not None:
            self._loops.visible = loops
        name = f"{self._below}/label"
        if top_m is not None:
            self._scene.add_label(name, self._label, position=top_m, anchor="bottom-center")
        elif self._scene.get_handle_by_name(name) is not None:
            self._scene.remove_by_name(name)
