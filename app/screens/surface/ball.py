"""The ball that is being chosen, in its true size, on the surface where somebody looks."""

from __future__ import annotations

import numpy as np

from app.screens.surface.stage import SurfaceStage
from app.screens.surface.view import PaintedView, Ray
from app.window.panel import PanelSession
from pipeline.types import FloatArray


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
