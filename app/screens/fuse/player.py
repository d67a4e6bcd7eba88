"""The player of a race: over iterations, or over the milliseconds that each method took."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from app.player import Player, Ruler
from app.screens.fuse.clock import RaceClock
from app.screens.fuse.view import RaceLane
from app.ui import Ui

CLOCKS = {"iterations": False, "milliseconds": True}


class RacePlayer(Player):
    """Moves over a race's clock."""

    def __init__(self, ui: Ui, on_place: Callable[[int], None], on_clock: Callable[[], None]) -> None:
        """Add the buttons and the slider.

        Args:
            ui: where to add them.
            on_place: called with every new place.
            on_clock: called when another clock is chosen.
        """
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
