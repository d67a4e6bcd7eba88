"""The player of a race: over iterations, or over the milliseconds that each method took."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from app.player import Player, Ruler
from app.screens.fuse.view import RaceLane
from app.ui import Ui
from pipeline.types import FloatArray

TICKS_MS = (1, 2, 5, 10, 20, 50, 100, 200, 500, 1000)
MOST_TICKS = 150
CLOCKS = {"iterations": False, "milliseconds": True}


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


class RacePlayer(Player):
    """Moves over a race's clock."""

    def __init__(self, ui: Ui, on_place: Callable[[int], None], on_clock: Callable[[], None]) -> None:
        """Add the buttons and the slider."""
        super().__init__(ui, on_place, Ruler("Iteration"), "Drag to any place of the race.")
        self._on_clock = on_clock
        self._lanes: Sequence[RaceLane] = ()
        self.clock: RaceClock | None = None

    def add_options(self) -> None:
        """Add clock, speed and loop."""
        self._axis = self._ui.gui.add_dropdown(
            "Axis",
            list(CLOCKS),
            hint="Whether the player and the curves count iterations, or the milliseconds each method took "
            "in this app's computing process, its preparation included.",
        )
        self._ui.when_changed(self._axis, lambda: self.load_race(self._lanes))
        self.add_speed((1.0, 30.0, 1.0), 4.0, "Slider steps a second.")
        self.add_loop()

    def load_race(self, lanes: Sequence[RaceLane]) -> None:
        """Take another race, at its start; none without lanes."""
        if not lanes:
            return
        self._lanes = lanes
        clock = self.clock = RaceClock.of(lanes, CLOCKS[self._axis.value])
        self._on_clock()
        label = "Time (ms)" if clock.in_ms else "Iteration"
        self.load(clock.length, ruler=Ruler(label, unit=clock.unit, step=clock.unit))

    def choose(self, in_ms: bool) -> None:
        """Count milliseconds or iterations from the next race on."""
        self._axis.value = next(name for name, value in CLOCKS.items() if value == in_ms)

    def seek_at(self, at: int | None) -> None:
        """Go to an iteration or millisecond; None is the end."""
        if self.clock is not None:
            self.seek(self.clock.length - 1 if at is None else at // self.clock.unit)
