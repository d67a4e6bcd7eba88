"""Surfaces of other methods over the same points, computed when they are first shown."""

from __future__ import annotations

import functools
from collections.abc import Callable, Hashable

from app.screens.surface.numbers import WAIT, note_html
from app.screens.surface.stage import SurfaceStage
from app.screens.surface.view import BaselineName, BaselineView
from app.web.markup import Markup
from app.window.gui import Piece
from app.window.panel import PanelSession


class Baselines:
    """The baselines computed for the current surface."""

    def __init__(
        self,
        session: PanelSession,
        stage: SurfaceStage,
        line: Piece[Markup],
        on_made: Callable[[BaselineName, bool], None],
    ) -> None:
        """Start without baselines.

        Args:
            session: the session that computes them.
            stage: the stage that draws them.
            line: HTML line about the baseline that is shown.
            on_made: called with the name, and True if it has been computed or False if that failed.
        """
        self._session, self._stage, self._line, self._on_made = session, stage, line, on_made
        self.views: dict[BaselineName, BaselineView] = {}
        """The computed baselines by name."""

    def forget(self) -> None:
        """Drop all baselines, because the surface has changed."""
        self.views = {}

    def show(self, name: BaselineName) -> None:
        """Draw a baseline; compute it first if necessary, with a note that it is being computed."""
        session, view = self._session, self.views.get(name)
        if view is None:
            made = functools.partial(self._made, name, session.spec.key("surface"))
            session.side_job("surface.baselines_job:baseline_job", name, on_end=made)
        self._line.content = WAIT if view is None else note_html(view)
        self._stage.draw_baseline(None if view is None else view.mesh)

    def _made(self, name: BaselineName, key: tuple[Hashable, ...], view: BaselineView | None) -> None:
        if key != self._session.spec.key("surface"):
            return
        if view is not None:
            self.views[name] = view
        self._on_made(name, view is not None)
