"""Turn a session's view to what its screen draws, or to the scene, and fit it to the window."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
import viser

from app.compute.records import DepthNode, SceneNode
from app.drawing.cameras import VIEW_FOV_RAD, look
from app.session.views import View, Views
from app.window.panel import PanelSession
from pipeline.kernels.geometry import apply
from pipeline.types import FloatArray

MOST_POINTS = 4000
"""Approximate number of points of each node's cloud to which a view is fitted."""
BARE = "/scene"
"""Scene node below which only measured points are drawn, no inferred ones."""


class Framing:
    """Turns a session's view when another object is shown or the window changes its shape."""

    def __init__(self, session: PanelSession, views: Views | None) -> None:
        """Keep the session and its ``views``, which are None in a lecture.

        Reset the browser's field of view, which a race in an earlier session may have narrowed.
        """
        self._session, self._views = session, views
        self._wide = self._by_screen = False
        self._shape = self._seen_shape = 0.0
        self._framed: View | None = None
        if views is not None:
            session.target.camera.fov = VIEW_FOV_RAD

    @property
    def framed(self) -> View | None:
        """Return the view to which the app turned last; None before that."""
        return self._framed if self._views is None else self._views.framed

    @property
    def nodes(self) -> tuple[SceneNode, ...]:
        """Return the scene's camera nodes; empty if another object is drawn, or two scenes side by side."""
        scene = self._session.results.view("scene")
        shows_scene = scene is not None and not self._by_screen and not self._wide
        return tuple(scene.nodes) if shows_scene else ()

    @property
    def clouds_m(self) -> list[FloatArray]:
        """Return (N, 3) thinned points per node, world frame, metres; with inferred ones if drawn."""
        nodes, depth = self.nodes, self._session.results.view("depth")
        clouds = [node.sensor for node in nodes]
        bare = self._session.current.drawn_below == BARE
        if depth is not None and not bare and _same_cameras(nodes, depth.nodes):
            clouds = [one.fused for one in depth.nodes]
        thinned = [one.points_m[:: max(1, len(one.points_m) // MOST_POINTS)] for one in clouds]
        return [
            apply(node.T_world_camera, points_m.astype(float))
            for node, points_m in zip(nodes, thinned, strict=True)
        ]

    def forget_turned(self) -> None:
        """Forget the view to which the user has turned, and return to the app's own."""
        if self._views is not None:
            self._views.take("")

    def frame(self, anew: bool, keep: bool) -> None:
        """Turn the view to what is shown.

        Args:
            anew: whether the scene is another one.
            keep: whether a view that the user has turned stays.
        """
        if self._views is None:
            self._turn(anew)
            self._framed = _view_of(self._session.clients())
        else:
            self._views.frame(lambda: self._turn(anew), keep)

    def follow_window(self) -> None:
        """Fit the view again if the picture's shape has changed, as when the dock opens or closes."""
        if self._window() != self._seen_shape:
            self._seen_shape = self._window()
            self._session.post(self._session.frame_view, False, True)

    def _turn(self, anew: bool) -> str:
        """Turn the view. Returns the kind of object that it looks at."""
        session = self._session
        below = session.current.drawn_below
        self._by_screen = session.current.look()
        if self._by_screen:
            self._shape = 0.0
            return below
        wide = any(panel.wide for panel in session.panels if panel.drawn_below == below)
        scene = session.results.view("scene")
        shape = self._window()
        if scene is not None and (anew or wide != self._wide or shape != self._shape):
            look(session.clients(), scene.stage, wide)
            self._wide, self._shape = wide, shape
        return "both" if wide else "scene"

    def _window(self) -> float:
        """Return the picture's width over height to one decimal; 1 for a session that many browsers share."""
        target = self._session.target
        return 1.0 if isinstance(target, viser.ViserServer) else round(target.camera.aspect, 1)


def _view_of(clients: Iterable[viser.ClientHandle]) -> View | None:
    """Return the view of the first browser; None if there is none."""
    camera = next((client.camera for client in clients), None)
    return None if camera is None else np.array([camera.position, camera.look_at])


def _same_cameras(nodes: tuple[SceneNode, ...], depths: tuple[DepthNode, ...]) -> bool:
    """Return whether the depth has the poses of the scene's nodes; it may still be that of another scene."""
    return len(nodes) == len(depths) and all(
        np.array_equal(node.T_world_camera, depth.T_world_camera)
        for node, depth in zip(nodes, depths, strict=True)
    )
