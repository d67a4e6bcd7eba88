"""How fine a quick look may be for the browser to keep up with the hand."""

from __future__ import annotations

from app.screens.surface.view import QUICK_POINTS

FEWEST_POINTS = QUICK_POINTS // 4
SLOW_S, FAST_S = 0.25, 0.11
"""A look that takes longer than the one is halved; shorter than the other, doubled. As half the points take
about half the time, the two must differ by more than a factor of two, or the detail would swing."""
LOOKS = 2
"""So many in a row must agree, as one may be late by chance."""


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
