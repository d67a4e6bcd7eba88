"""Drawing of the rolling ball: the mesh is sent once; each step sends newest triangles, front and ball."""

from __future__ import annotations

import numpy as np
import viser

from app.drawing.colors import DELIVERED, LOSS, NEUTRAL, SOURCE
from app.screens.surface.walk_view import WalkView
from pipeline.types import FloatArray, IntArray

PIECES = 100
"""Approximate number of pieces into which the whole mesh is split."""
POINT_SHARE = 0.3
"""Size of a point over the smallest radius."""
BALL_OPACITY = 0.45
SHADES = ((222, 233, 245), (178, 200, 226), (136, 164, 202), (100, 126, 172))
"""Colours of the triangles of the first ball, the second and so on; the last for all others."""
WIRE = (70, 84, 104)


class RollingDrawing:
    """Drawing of one walk of the ball below a scene node; it can show any step.

    The browser remembers a node's state by its name, so every walk needs a node of its own.
    """

    def __init__(self, scene: viser.SceneApi, below: str, view: WalkView) -> None:
        self._scene, self._below, self._view = scene, below, view
        self._done = -1
        self._add_points()
        self._front = self._add_lines("front", DELIVERED, 3.0)
        self._dead = self._add_lines("dead", LOSS, 2.5)
        self._pivot = self._add_lines("pivot", SOURCE, 6.0)
        self._ends, self._balls = pieces(view)
        starts = np.append(0, self._ends[:-1])
        self._pieces = [
            self._add_mesh(f"piece{index}", view.triangles[start:end], int(ball))[0]
            for index, (start, end, ball) in enumerate(zip(starts, self._ends, self._balls, strict=True))
        ]
        self._whole = 0
        self._newest = self._add_mesh("newest", view.triangles[:1], 0, view.points_m)
        self._ball = scene.add_icosphere(
            f"{below}/ball", view.radii_m[0], SOURCE, subdivisions=4, opacity=BALL_OPACITY, cast_shadow=False
        )

    def show(self, done: int, place: int) -> None:
        """Show the mesh after ``done`` steps, and the ball at rest (``place`` 0) or on its next arc."""
        view = self._view
        if done != self._done:
            self._done = done
            self._show_mesh(view.count(done))
            front, dead = view.open_edges(done)
            self._show_lines(self._front, front)
            self._show_lines(self._dead, dead)
        pivot = view.pivot(done) if place else None
        self._show_lines(self._pivot, np.empty((0, 2), np.int32) if pivot is None else pivot[None])
        step, at = (done, place - 1) if place else (max(done - 1, 0), -1)
        self._ball.radius = view.radii_m[view.step_radius[step]]
        self._ball.position = view.places_m[step, at]

    def _show_mesh(self, count: int) -> None:
        """Show the first ``count`` triangles: whole pieces, and the beginning of the next."""
        whole = int(np.searchsorted(self._ends, count, side="right"))
        for index in range(min(whole, self._whole), max(whole, self._whole)):
            self._pieces[index].visible = index < whole
        self._whole = whole
        newest = self._view.triangles[self._ends[whole - 1] if whole else 0 : count]
        self._newest[0].visible = bool(len(newest))
        if len(newest):
            self._newest[0].color = _shade(int(self._balls[whole]))
            for mesh in self._newest:
                mesh.faces = newest.astype(np.uint32)

    def _show_lines(self, lines: viser.LineSegmentsHandle, ends: IntArray) -> None:
        lines.visible = bool(len(ends))
        if len(ends):
            lines.points = self._view.points_m[ends]

    def _add_points(self) -> None:
        view = self._view
        self._scene.add_point_cloud(
            f"{self._below}/points",
            view.points_m,
            np.array(NEUTRAL, np.uint8) if view.colors is None else view.colors,
            point_size=POINT_SHARE * view.radii_m[0],
            point_shape="circle",
            point_shading="flat",
            precision="float32",
        )

    def _add_lines(self, name: str, color: tuple[int, int, int], width: float) -> viser.LineSegmentsHandle:
        return self._scene.add_line_segments(
            f"{self._below}/{name}",
            np.zeros((1, 2, 3), np.float32),
            np.array(color),
            thickness=width,
            thickness_units="screen",
            visible=False,
        )

    def _add_mesh(
        self, name: str, triangles: IntArray, ball: int, points_m: FloatArray | None = None
    ) -> list[viser.MeshHandle]:
        """Add a hidden mesh and, in a close-up, its edges as a child node. Returns their handles.

        A mesh whose triangles will change gets all points (``points_m``), others only those that they use.
        """
        if points_m is None:
            used, corners = np.unique(triangles, return_inverse=True)
            points_m, triangles = self._view.points_m[used], corners.reshape(-1, 3)
        name = f"{self._below}/{name}"
        faces = triangles.astype(np.uint32)
        mesh = self._scene.add_mesh_simple(
            name, points_m, faces, color=_shade(ball), flat_shading=True, side="double", visible=False
        )
        if not self._view.request.close_up:
            return [mesh]
        wire = self._scene.add_mesh_simple(f"{name}/wire", points_m, faces, color=WIRE, wireframe=True)
        return [mesh, wire]


def pieces(view: WalkView) -> tuple[IntArray, IntArray]:
    """Return (P,) end index of each piece of the triangles, and (P,) index of the ball that made it."""
    count = len(view.triangles)
    ball = np.repeat(view.step_radius, np.diff(view.step_ends, prepend=0))
    size = -(-count // PIECES)
    changes = np.flatnonzero(np.diff(ball)) + 1
    ends = np.unique(np.concatenate([np.arange(size, count, size), changes, [count]]))
    return ends, ball[ends - 1]


def _shade(ball: int) -> tuple[int, int, int]:
    return SHADES[min(ball, len(SHADES) - 1)]
