"""Surfaces of other methods over the same points, each made when it is first shown."""

from __future__ import annotations

import functools
from collections.abc import Callable, Hashable

from app.records import MeshView
from app.screens.surface.view import BaselineName, BaselineView
from app.ui import Workbench


class Baselines:
    """Keeps the baselines of the surface that is wanted, and has missing ones made."""

    def __init__(
        self, session: Workbench, on_made: Callable[[BaselineName, BaselineView | None], None]
    ) -> None:
        """Start without any.

        Args:
            session: runs the jobs.
            on_made: called with a baseline that had to be made, or None if it could not be.
        """
        self._session, self._on_made = session, on_made
        self._views: dict[BaselineName, BaselineView] = {}

    @property
    def meshes(self) -> dict[str, MeshView]:
        """Those that are there, by name."""
        return {name: view.mesh for name, view in self._views.items()}

    def forget(self) -> None:
        """Drop all: another surface is wanted."""
        self._views = {}

    def want(self, name: BaselineName) -> BaselineView | None:
        """A baseline that is there; None has it made."""
        if name not in self._views:
            session = self._session
            ended = functools.partial(self._ended, name, session.spec.key("surface"))
            job = "surface.baselines_job:baseline_job"
            session.side_job(job, name, on_end=ended)
        return self._views.get(name)

    def _ended(self, name: BaselineName, key: tuple[Hashable, ...], view: BaselineView | None) -> None:
        if key != self._session.spec.key("surface"):
            return
        if view is not None:
            self._views[name] = view
        self._on_made(name, view)
