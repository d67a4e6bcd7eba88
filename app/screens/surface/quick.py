"""Surfaces of a radius while a hand moves it: always the newest, and no faster than the browser draws."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import replace

from app.screens.surface.view import QUICK_POINTS, PaintedView, PaintRequest
from app.window.acknowledgement import DrawAcknowledgement
from app.window.panel import PanelSession

QUIET_S = 0.4
"""When the radius has not moved for so long, it rests."""

FEWEST_POINTS = QUICK_POINTS // 4
SLOW_S, FAST_S = 0.25, 0.11
"""A look that takes longer than the one is halved; shorter than the other, doubled. As half the points take
about half the time, the two must differ by more than a factor of two, or the detail would swing."""
LOOKS = 2
"""So many in a row must agree, as one may be late by chance."""


class QuickLook:
    """One surface at a time: rolled, sent, drawn; then that of where the hand is by now."""

    def __init__(
        self,
        session: PanelSession,
        on_view: Callable[[PaintedView], None],
        on_drawn: Callable[[], None],
        on_rest: Callable[[], None],
    ) -> None:
        """Add the hidden parts to the current container.

        Args:
            session: where to add them and who runs the jobs.
            on_view: called with each surface; it is to draw it and to call ``sent``.
            on_drawn: called when what was sent last stands on the screen.
            on_rest: called when the radius rests.
        """
        self._session, self._on_view, self._on_drawn, self._on_rest = session, on_view, on_drawn, on_rest
        self._settle = session.ui.debounce(QUIET_S, self._rest)
        self._acknowledgement = DrawAcknowledgement(session.ui, self._drawn)
        self._next: PaintRequest | None = None
        self._rolling = False
        self._detail = Detail()
        self._asked_s: float | None = None

    @property
    def moving(self) -> bool:
        """Whether the radius has not come to rest."""
        return self._settle.pending

    def want(self, request: PaintRequest) -> None:
        """The radius has moved."""
        if not self.moving:
            self._acknowledgement.hold()
        self._settle.restart()
        self._next = request
        self._go_on()

    def sent(self, vertices: Sequence[int] = ()) -> None:
        """Surfaces are on their way to the browser; quick ones, of so many vertices each."""
        self._acknowledgement.ask(vertices, hold=self.moving)

    def _go_on(self) -> None:
        session, request = self._session, self._next
        ready = session.results.fresh("fuse", session.spec)
        if ready and request is not None and not self._rolling and not self._acknowledgement.waiting:
            self._rolling, self._next = True, None
            self._asked_s = time.monotonic()
            request = replace(request, most_points=self._detail.points)
            session.quick_job("surface.paint_job:paint_job", request, on_end=self._came)

    def _came(self, view: PaintedView | None) -> None:
        self._rolling = False
        if view is not None:
            self._on_view(view)
        if not self._acknowledgement.waiting:
            self._go_on()

    def _drawn(self) -> None:
        if self._asked_s is not None:
            self._detail.took(time.monotonic() - self._asked_s)
            self._asked_s = None
        self._on_drawn()
        self._go_on()

    def _rest(self) -> None:
        self._next = None
        self._on_rest()


class Detail:
    """The number of points, which follows what a browser manages."""

    def __init__(self) -> None:
        self.points = QUICK_POINTS
        self._times_s: list[float] = []

    def took(self, seconds: float) -> None:
        """A look at so many points was rolled, sent and drawn in this time."""
        self._times_s.append(seconds)
        if len(self._times_s) < LOOKS:
            return
        if min(self._times_s) > SLOW_S:
            self.points = max(self.points // 2, FEWEST_POINTS)
        elif max(self._times_s) < FAST_S:
            self.points = min(self.points * 2, QUICK_POINTS)
        self._times_s.clear()
