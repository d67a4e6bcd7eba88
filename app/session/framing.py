"""Turn a session's view to what its screen draws, or to the scene, and fit it to the window."""

from __future__ import annotations

import viser

from app.drawing.cameras import look, stage_of
from app.session.views import Views
from app.window.panel import PanelSession


class Framing:
    """Turns a session's view when another object is shown or the window changes its shape."""

    def __init__(self, session: PanelSession, views: Views | None) -> None:
        """Keep the session and its ``views``, which are None in a lecture."""
        self._session, self._views = session, views
        self._wide = False
        self._shape = self._seen_shape = 0.0

    def frame(self, anew: bool, keep: bool) -> None:
        """Turn the view to what is shown.

        Args:
            anew: whether the scene is another one.
            keep: whether a view that the user has turned stays.
        """
        if self._views is None:
            self._turn(anew)
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
        if session.current.look():
            self._shape = 0.0
            return below
        wide = any(panel.wide for panel in session.panels if panel.drawn_below == below)
        scene = session.results.view("scene")
        shape = self._window()
        if scene is not None and (anew or wide != self._wide or shape != self._shape):
            look(session.clients(), stage_of(scene.nodes), wide)
            self._wide, self._shape = wide, shape
        return "both" if wide else "scene"

    def _window(self) -> float:
        """Return the picture's width over height to one decimal; 1 for a session that many browsers share."""
        target = self._session.target
        return 1.0 if isinstance(target, viser.ViserServer) else round(target.camera.aspect, 1)
