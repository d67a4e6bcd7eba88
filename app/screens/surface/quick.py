"""Surfaces for a radius that is being dragged: always the newest, no faster than the browser draws."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import replace

from app.screens.surface.view import QUICK_POINTS, PaintedView, PaintRequest
from app.window.acknowledgement import TIMEOUT_S, DrawAcknowledgement
from app.window.panel import PanelSession

QUIET_S = 0.4
"""Time without a change after which the radius counts as at rest once its surface is drawn, seconds."""

FEWEST_POINTS = QUICK_POINTS // 4
SLOW_S, FAST_S = 0.25, 0.11
"""Above the first time, a look's points are halved; below the second, doubled. Half the points take about
half the time, so the two must differ by more than a factor of two, or the detail would oscillate."""
LOOKS = 2
"""Number of consecutive times that must agree, because one may be late by chance."""


class QuickLook:
    """Computes, sends and draws one surface, then the one for the slider's newest value."""

    def __init__(
        self,
        session: PanelSession,
        on_view: Callable[[PaintedView], None],
        on_drawn: Callable[[], None],
        on_rest: Callable[[], None],
    ) -> None:
        """Add the hidden controls to the current container.

        Args:
            session: the session that shows the surfaces and runs the jobs.
            on_view: called with each surface; it must draw it and call ``sent``.
            on_drawn: called when the browser has drawn what was sent last.
            on_rest: called when the radius is at rest.
        """
        self._session, self._on_view, self._on_drawn, self._on_rest = session, on_view, on_drawn, on_rest
        self._settle = session.ui.debounce(QUIET_S, self._quiet)
        self._last_look = session.ui.debounce(TIMEOUT_S, self._rest)
        self._acknowledgement = DrawAcknowledgement(session.ui, self._drawn)
        self._next: PaintRequest | None = None
        self._rolling = False
        self.moving = False
        """Whether the radius has not come to rest."""
        self._detail = Detail()
        self._submitted_s: float | None = None

    def want(self, request: PaintRequest) -> None:
        """Request a surface of a new radius; the newest request replaces one that waits."""
        self.moving = True
        self._last_look.cancel()
        self._settle.restart()
        self._next = request
        self._go_on()

    def sent(self, vertices: Sequence[int] = ()) -> None:
        """Wait until the browser has drawn what was sent; ``vertices`` are vertex counts of its meshes."""
        self._acknowledgement.ask(vertices, hold=self.moving)

    def _go_on(self) -> None:
        session, request = self._session, self._next
        if self._rolling or self._acknowledgement.waiting:
            return
        if request is not None and session.results.fresh("fuse", session.spec):
            if not self._acknowledgement.held:
                self._acknowledgement.hold()
                return
            self._rolling, self._next = True, None
            self._submitted_s = time.monotonic()
            request = replace(request, most_points=self._detail.points)
            session.quick_job(request.job, request, on_end=self._came, key=request.key(session.spec))
        elif self._last_look.pending:
            self._rest()

    def _came(self, view: PaintedView | None) -> None:
        self._rolling = False
        if view is not None:
            if view.points > 1.5 * self._detail.points:  # a small ball needs them, whatever time they take
                self._submitted_s = None
            self._on_view(view)
        self._go_on()

    def _drawn(self) -> None:
        if self._submitted_s is not None:
            self._detail.took(time.monotonic() - self._submitted_s)
            self._submitted_s = None
        self._on_drawn()
        self._go_on()

    def _quiet(self) -> None:
        """The slider has stopped: show the surface of its last value, then rest."""
        self._last_look.restart()
        self._go_on()

    def _rest(self) -> None:
        self._last_look.cancel()
        self.moving, self._rolling, self._next = False, False, None
        self._on_rest()


class Detail:
    """The number of points to which quick looks thin a cloud, adapted to the browser's speed.

    Looks with small balls, which need more points, do not count.
    """

    def __init__(self) -> None:
        self.points = QUICK_POINTS
        self._times_s: list[float] = []

    def took(self, seconds: float) -> None:
        """Take the time in which a look was computed, sent and drawn, and adapt the number of points."""
        self._times_s.append(seconds)
        if len(self._times_s) < LOOKS:
            return
        if min(self._times_s) > SLOW_S:
            self.points = max(self.points // 2, FEWEST_POINTS)
        elif max(self._times_s) < FAST_S:
            self.points = min(self.points * 2, QUICK_POINTS)
        self._times_s.clear()
