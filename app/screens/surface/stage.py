"""Placement of the surfaces in the 3-D scene."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial

import numpy as np
import viser

from app.compute.cuts import Cut, kept_on_ray
from app.compute.records import MeshView, Stage
from app.drawing.colors import SOURCE
from app.drawing.glb import Parts
from app.screens.surface.draw import SurfaceDrawing
from app.screens.surface.labels import AFTER, BASELINES, BEFORE, BOTH
from app.screens.surface.view import PaintedMesh, PaintRequest, Ray, UnusedView, Which
from app.window.panel import PanelSession
from pipeline.types import FloatArray

PARTS = ("/surface/after", "/surface/before", "/surface/baseline")
"""Nodes of the surfaces, which may stand side by side."""
BALL_OPACITY = 0.55
APART = 0.63
"""Distance of each of two surfaces from the middle over the scene's width: perspective widens the parts
before the middle."""


class SurfaceStage:
    """The surfaces after and before fusion, a baseline's, and the ball; some of them are shown."""

    def __init__(self, scene: viser.SceneApi) -> None:
        """Draw below "/surface"."""
        self._drawings: dict[Which, SurfaceDrawing] = {
            "after": SurfaceDrawing(scene, PARTS[0], AFTER),
            "before": SurfaceDrawing(scene, PARTS[1], BEFORE.partition(" (")[0]),
        }
        self._drawn: dict[Which, MeshView | PaintedMesh] = {}
        self._baseline = SurfaceDrawing(scene, PARTS[2], "baseline")
        self._ball = scene.add_icosphere(
            "/surface/ball",
            0.02,
            SOURCE,
            subdivisions=4,
            opacity=BALL_OPACITY,
            cast_shadow=False,
            visible=False,
        )
        self._ball_name = scene.add_label("/surface/ball/name", "", anchor="bottom-center")
        self.shown = AFTER
        """One of ``app.screens.surface.labels.SHOWN``."""
        self._offset_m: FloatArray = np.zeros(3)
        self._middle_m: FloatArray = np.zeros(3)
        """(3,) middle of the scene."""

    @property
    def which(self) -> tuple[Which, ...]:
        """The ball's surfaces that are shown, or that are ready while a baseline is shown."""
        if self.shown == BOTH:
            return ("after", "before")
        return ("before",) if self.shown == BEFORE else ("after",)

    def offset_m(self, which: Which) -> FloatArray:
        """Return the (3,) offset of a surface from the middle of the scene."""
        return self._offset_m if which == "after" else -self._offset_m

    def aimed_at(self, origin_m: FloatArray, direction: FloatArray) -> Which:
        """Return the shown surface whose middle a ray passes at the smallest angle.

        Args:
            origin_m: (3,) origin of the ray, world frame.
            direction: (3,) direction of the ray, world frame.
        """

        def along(which: Which) -> float:
            there_m = self._middle_m + self.offset_m(which) - origin_m
            return float(there_m @ direction) / max(float(np.linalg.norm(there_m)), 1e-9)

        return max(self.which, key=along)

    def draw(self, meshes: Mapping[Which, MeshView | PaintedMesh | None], unseen: bool = False) -> list[int]:
        """Draw those of the ball's surfaces that are not drawn yet.

        Args:
            meshes: the new meshes; None is left out.
            unseen: whether the browser draws nothing until it has them.

        Returns:
            Vertex counts of the meshes that are new to the browser and shown.
        """
        counts = []
        for which, mesh in meshes.items():
            if mesh is None or (which in self._drawn and self._drawn[which].glb == mesh.glb):
                continue
            self._drawings[which].draw(mesh, unseen)
            self._drawn[which] = mesh
            if which in self.which and mesh.glb:
                counts.append(Parts.of(mesh.glb).vertices)
        return counts

    def draw_unused(self, unused: Mapping[Which, UnusedView]) -> None:
        """Draw the points that the ball left out of these surfaces."""
        for which, points in unused.items():
            self._drawings[which].draw_unused(points)

    def draw_ball(self, center_m: FloatArray | None, radius_m: float) -> None:
        """Draw the ball on the first surface that is shown, or hide it."""
        self._ball.visible = center_m is not None
        if center_m is not None:
            self._ball.radius = radius_m
            self._ball.position = center_m + self.offset_m(self.which[0])
            self._ball_name.text = f"ball, {2000.0 * radius_m:.0f} mm across"
            self._ball_name.position = (0.0, 0.0, 1.2 * radius_m)

    def draw_baseline(self, mesh: MeshView | None) -> None:
        """Draw a baseline's surface, or none."""
        self._baseline.clear()
        if mesh is not None:
            self._baseline.draw(mesh)

    def arrange(self, place: Stage | None, loops: bool, unused: bool, hidden: bool) -> None:
        """Show the chosen surfaces, two of them side by side.

        Args:
            place: the scene's viewpoint; None before there is one.
            loops: whether the rims of holes are drawn.
            unused: whether the points that the ball left out are drawn.
            hidden: whether the surfaces are hidden by a walk.
        """
        self._offset_m, top_m = np.zeros(3), None
        if self.shown == BOTH and place is not None:
            self._offset_m, self._middle_m = APART * place.width_m * place.right, place.middle_m
            top_m = place.top_m
        baseline = self.shown in BASELINES
        for which, drawing in self._drawings.items():
            visible = which in self.which and not hidden and not baseline
            drawing.show(visible, loops, self.offset_m(which), top_m)
            drawing.show_unused(unused)
        self._baseline.show(baseline and not hidden, loops, np.zeros(3), None)

    def drop_old(self) -> None:
        """Remove meshes that a newer one has replaced, after the browser has drawn that one."""
        for drawing in self._drawings.values():
            drawing.drop_old()


class ChosenBall:
    """The ball at the last clicked point or, before a click, in the middle of the view.

    While the radius is dragged, the pointer is on the slider, so it cannot set the place.
    """

    def __init__(self, session: PanelSession, stage: SurfaceStage) -> None:
        self._session, self._stage = session, stage
        self._clicked: tuple[FloatArray, FloatArray] | None = None
        """(3,) origin and direction of the clicked ray, in the frame of the surface that was clicked."""
        self._request: PaintRequest | None = None

    def clicked(self, origin_m: FloatArray, direction: FloatArray, cut: Cut) -> None:
        """Put the ball where this ray first meets the cloud in what a cut keeps.

        Args:
            origin_m: (3,) origin of the ray, world frame.
            direction: (3,) direction of the ray.
            cut: what is left out of the picture, in the frame of the surface.
        """
        origin_m = self._in_surface(origin_m, direction)
        for begin, _ in kept_on_ray(cut, origin_m, direction)[:1]:
            self._clicked = origin_m + begin * direction, direction

    def forget(self) -> None:
        """Forget the clicked place, which belongs to another scene."""
        self._clicked = None

    def _ray(self) -> Ray | None:
        """Return the ray to the ball, in the frame of the surfaces; None without a browser."""
        seen = self._clicked or self._middle()
        if seen is None:
            return None
        origin_m, direction = seen
        return Ray(tuple(origin_m.tolist()), tuple(direction.tolist()))

    def _in_surface(self, origin_m: FloatArray, direction: FloatArray) -> FloatArray:
        """Return (3,) the origin of a ray in the scene, in the frame of the surface that it aims at."""
        return origin_m - self._stage.offset_m(self._stage.aimed_at(origin_m, direction))

    def show(self, request: PaintRequest) -> None:
        """Draw the ball of a quick look once its place is computed, unless it is hidden by then."""
        self._request, ray = request, self._ray()
        if ray is not None:
            drawn = partial(self._draw, request)
            self._session.quick_job("surface.paint_job:ball_job", request, ray, on_end=drawn)

    def hide(self) -> None:
        """Hide the ball."""
        self._request = None
        self._stage.draw_ball(None, 0.0)

    def _draw(self, request: PaintRequest, ball_m: FloatArray | None) -> None:
        if request is self._request:
            self._stage.draw_ball(ball_m, request.radius_m or 0.0)

    def _middle(self) -> tuple[FloatArray, FloatArray] | None:
        client = next(iter(self._session.clients()), None)
        if client is None:
            return None
        origin_m = np.array(client.camera.position, float)
        direction = np.array(client.camera.look_at, float) - origin_m
        return self._in_surface(origin_m, direction), direction
