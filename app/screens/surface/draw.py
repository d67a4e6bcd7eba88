"""Drawings of a surface: the mesh, its holes as red loops, and the points that the ball left out."""

from __future__ import annotations

import numpy as np
import viser

from app.compute.records import MeshView
from app.drawing.clouds import shorten
from app.drawing.colors import INFERRED, TARGET
from app.screens.surface.view import PaintedMesh, UnusedView
from pipeline.types import FloatArray


class SurfaceDrawing:
    """One mesh, its boundary loops and its left-out points below a scene node."""

    def __init__(self, scene: viser.SceneApi, below: str, label: str) -> None:
        self._scene, self._below, self._label = scene, below, label
        self._meshes: list[viser.GlbHandle] = []
        self._rims: list[viser.GlbHandle] = []
        self._points: dict[str, viser.PointCloudHandle] = {}
        self._points_shown = True
        self._made = 0
        self._rims_shown = True
        self._frame = scene.add_frame(below, show_axes=False)

    def draw(self, view: MeshView | PaintedMesh, unseen: bool = False) -> None:
        """Draw a mesh; ``drop_old`` removes the previous one afterwards.

        A browser needs some frames to read a mesh. The previous one stays until then, so that the surface
        does not blink. If the browser draws nothing in between (``unseen``), the previous one is hidden at
        once and not removed, so that its material stays and the shader need not be compiled again.
        """
        self._made += 1
        replaced = []
        for kind, glb, handles in (("mesh", view.glb, self._meshes), ("rims", view.rims_glb, self._rims)):
            shorten(handles, 1 if glb else 0)
            replaced += handles
            if glb:
                handles.append(self._add(f"{kind}-{self._made}", glb, kind == "mesh" or self._rims_shown))
        if unseen:  # only now: a page takes messages in order, and waits for the content of a mesh
            for handle in replaced:
                handle.visible = False

    def draw_unused(self, unused: UnusedView) -> None:
        """Draw the points that the ball left out, in the colours of their sources."""
        for name, points_m, color in (
            ("measured", unused.measured_m, TARGET),
            ("inferred", unused.inferred_m, INFERRED),
        ):
            handle = self._points.get(name)
            if handle is None:
                self._points[name] = handle = self._scene.add_point_cloud(
                    f"{self._below}/{name}",
                    points_m,
                    np.array(color),
                    point_shape="circle",
                    point_shading="flat",
                    precision="float32",
                )
            handle.points, handle.point_size = points_m, unused.size_m
            handle.visible = self._points_shown

    def show_unused(self, shown: bool) -> None:
        """Show or hide the points that the ball left out."""
        self._points_shown = shown
        for handle in self._points.values():
            handle.visible = shown

    def drop_old(self) -> None:
        """Remove all meshes but the last."""
        for handles in (self._meshes, self._rims):
            shorten(handles, 1)

    def clear(self) -> None:
        """Remove everything."""
        for handles in (self._meshes, self._rims):
            shorten(handles, 0)

    def show(self, visible: bool, rims: bool, offset_m: FloatArray, top_m: FloatArray | None) -> None:
        """Show or hide the surface at a (3,) offset, with its name at ``top_m`` (3,); None shows no name."""
        self._frame.visible = visible
        self._frame.position = offset_m
        self._rims_shown = rims
        for handle in self._rims:
            handle.visible = rims
        name = f"{self._below}/label"
        if top_m is not None:
            self._scene.add_label(name, self._label, position=top_m, anchor="bottom-center")
        elif self._scene.get_handle_by_name(name) is not None:
            self._scene.remove_by_name(name)

    def _add(self, name: str, glb: bytes, visible: bool) -> viser.GlbHandle:
        return self._scene.add_glb(f"{self._below}/{name}", glb, cast_shadow=False, visible=visible)
