"""Who computes the walks of the rolling ball that are watched."""

from __future__ import annotations

import functools
from collections.abc import Callable, Hashable

from app.screens.surface.rolling import RollingFolder
from app.screens.surface.walk_view import WalkRequest, WalkView
from app.window.panel import PanelSession


class Walks:
    """The folder of the rolling ball, with its jobs and its close-up."""

    def __init__(self, session: PanelSession, on_change: Callable[[], None]) -> None:
        """Add the folder; ``on_change`` is called when a walk comes or goes."""
        self._session, self._on_change = session, on_change
        self.folder = RollingFolder(session.ui, self._watch)

    def close(self) -> None:
        """Take the walk away, and stand back again after a close-up."""
        near = self.folder.focus is not None
        self.folder.forget()
        if near:
            self._session.frame_view(anew=True)

    def _watch(self, request: WalkRequest | None) -> None:
        session = self._session
        if request is None:
            session.cancel_side_job()
            self.close()
            self._on_change()
        elif session.results.view("fuse") is not None:
            ended = functools.partial(self._walked, session.spec.key("surface"))
            session.side_job("surface.walk_job:walk_job", request, on_end=ended)

    def _walked(self, key: tuple[Hashable, ...], view: WalkView | None) -> None:
        if key == self._session.spec.key("surface"):
            self.folder.load(view)
            self._on_change()
            self._session.frame_view(anew=True)
