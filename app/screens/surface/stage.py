"""Which surfaces stand where in the 3-D scene."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import viser

from app.compute.records import MeshView
from app.drawing.cameras import Stage
from app.drawing.colors import SOURCE
from app.screens.surface.draw import SurfaceDrawing
from app.screens.surface.labels import AFTER, BASELINES, BEFORE, BOTH
from app.screens.surface.view import PaintedMesh, PaintedView, Ray, UnusedView, Which
from app.window.panel import PanelSession
from pipeline.types import FloatArray

BALL_OPACITY = 0.55
APART = 0.63
"""From the middle to each of two surfaces side by side, over the width of the scene: what stands nearer to
the view than its middle looks wider."""


class SurfaceStage:
    """The surfaces after and before fusion, and a baseline's, of which some are shown."""

    def __init__(self, scene: viser.SceneApi) -> None:
        """Draw below "/surface"."""
        self._drawings: dict[Which, SurfaceDrawing] = {
            "after": SurfaceDrawing(scene, "/surface/after", AFTER),
            "before": SurfaceDrawing(scene, "/surface/before", BEFORE.partition(" (")[0]),
        }
        self._drawn: dict[Which, MeshView | PaintedMesh] = {}
        self._baseline = SurfaceDrawing(scene, "/surface/baseline", "baseline")
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

    @property
    def which(self) -> tuple[Which, ...]:
        """The ball's surfaces that are shown, or that stand ready behind a baseline."""
        if self.shown == BOTH:
            return ("after", "before")
        return ("before",) if self.shown == BEFORE else ("after",)

    def offset_m(self, which: Which) -> FloatArray:
        """(3,) from the middle of the scene to a surface."""
        return self._offset_m if which == "after" else -self._offset_m

    def draw(self, which: Which, mesh: MeshView | PaintedMesh, unseen: bool = False) -> bool:
        """Draw one of the ball's surfaces; False if it is drawn already.

        Args:
            which: which one.
            mesh: what it is now.
            unseen: whether the browser draws nothing until it has this one.
        """
        if which in self._drawn and self._drawn[which].glb == mesh.glb:
            return False
        self._drawings[which].draw(mesh, unseen)
        self._drawn[which] = mesh
        return True

    def draw_unused(self, unused: Mapping[Which, UnusedView]) -> None:
        """Draw the points that the ball left out, of the surfaces that are given."""
        for which, points in unused.items():
            self._drawings[which].draw_unused(points)

    def draw_ball(self, center_m: FloatArray | None, radius_m: float) -> None:
        """The ball on the first surface that is shown, or none."""
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
        """Show what is to be shown, two side by side.

        Args:
            place: where the scene is; None before there is one.
            loops: whether the rims of holes are drawn.
            unused: whether the points that the ball left out are.
            hidden: whether something else is watched instead.
        """
        both = self.shown == BOTH and place is not None
        self._offset_m = APART * place.width_m * place.right if both and place is not None else np.zeros(3)
        top_m = place.top_m if both and place is not None else None
        baseline = self.shown in BASELINES
        for which, drawing in self._drawings.items():
            visible = which in self.which and not hidden and not baseline
            drawing.show(visible, loops, self.offset_m(which), top_m)
            drawing.show_unused(unused)
        self._baseline.show(baseline and not hidden, loops, np.zeros(3), None)

    def drop_old(self) -> None:
        """Take away what a newer mesh has replaced, once that one stands on the screen."""
        for drawing in self._drawings.values():
            drawing.drop_old()


class ChosenBall:
    """It lies where the scene was clicked last or, before that, in the middle of the view.

    While the radius is dragged, the pointer is on the slider, so it cannot say where.
    """

    def __init__(self, session: PanelSession, stage: SurfaceStage) -> None:
        self._session, self._stage = session, stage
        self._clicked: tuple[FloatArray, FloatArray] | None = None

    def clicked(self, origin_m: FloatArray, direction: FloatArray) -> None:
        """Lie here from now on; the ray is in the world."""
        self._clicked = origin_m, direction

    def forget(self) -> None:
        """Another scene: the place that was clicked is gone."""
        self._clicked = None

    def ray(self) -> Ray | None:
        """The line of sight to its place, in the frame of the first surface shown; None if nobody looks."""
        seen = self._clicked or self._middle()
        if seen is None:
            return None
        origin_m, direction = seen
        origin_m = origin_m - self._stage.offset_m(self._stage.which[0])
        return Ray(tuple(origin_m.tolist()), tuple(direction.tolist()))

    def show(self, view: PaintedView) -> None:
        """Draw it as a quick look says."""
        self._stage.draw_ball(view.ball_m, view.request.radius_m or 0.0)

    def hide(self) -> None:
        """Draw it no more."""
        self._stage.draw_ball(None, 0.0)

    def _middle(self) -> tuple[FloatArray, FloatArray] | None:
        client = next(iter(self._session.clients()), None)
        if client is None:
            return None
        origin_m = np.array(client.camera.position, float)
        return origin_m, np.array(client.camera.look_at, float) - origin_m
