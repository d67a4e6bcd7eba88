"""The clock of a race: which step every lane shows at a place of the player, by iteration or by time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from app.screens.fuse.view import RaceLane
from pipeline.types import FloatArray

TICKS_MS = (1, 2, 5, 10, 20, 50, 100, 200, 500, 1000)
MOST_TICKS = 150


@dataclass(frozen=True, slots=True)
class RaceClock:
    """Places 0 to ``length`` - 1; a lane that ended before stays at its end."""

    xs: tuple[FloatArray, ...]
    """One (K,) ascending array a lane: when it reached each step, in iterations or milliseconds."""
    unit: int
    """Iterations or milliseconds from one place to the next."""
    in_ms: bool

    @staticmethod
    def of(lanes: Sequence[RaceLane], in_ms: bool) -> RaceClock:
        """The clock of these lanes."""
        if not in_ms:
            return RaceClock(tuple(np.arange(len(lane.steps), dtype=float) for lane in lanes), 1, False)
        xs = tuple(1000.0 * np.array([step.time_s for step in lane.steps]) for lane in lanes)
        longest_ms = max(x[-1] for x in xs)
        unit = next((tick for tick in TICKS_MS if longest_ms <= tick * MOST_TICKS), TICKS_MS[-1])
        return RaceClock(xs, unit, True)

    @property
    def label(self) -> str:
        """Of an axis."""
        return "time, ms" if self.in_ms else "iteration"

    @property
    def length(self) -> int:
        """Places, so that at the last one every lane is at its end."""
        return int(np.ceil(max(x[-1] for x in self.xs) / self.unit)) + 1

    def rows(self, place: int) -> tuple[int, ...]:
        """The step of each lane."""
        return tuple(int(np.searchsorted(x, place * self.unit, side="right")) - 1 for x in self.xs)
