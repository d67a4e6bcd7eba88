"""The race's player: buttons, the slider over iterations or milliseconds, speed, loop and clock."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import viser

from app.player import Ticker, Timeline
from app.records import RaceLane
from app.screens.fuse.clock import RaceClock

CLOCKS = {"iterations": False, "milliseconds": True}


class RacePlayer:
    """Moves over a race's clock and tells what to show."""

    def __init__(
        self,
        gui: viser.GuiApi,
        post: Callable[..., None],
        changed: Callable[[Any, Callable[[], None]], None],
        on_place: Callable[[int], None],
        on_clock: Callable[[], None],
    ) -> None:
        """Add the buttons and the slider.

        Args:
            gui: where to add them.
            post: runs a function on the session's thread.
            changed: registers an action for a change of a handle by a person.
            on_place: called with every new place.
            on_clock: called when another clock is chosen.
        """
        self._gui, self._post, self._changed, self._on_clock = gui, post, changed, on_clock
        self._on_place = on_place
        self._lanes: Sequence[RaceLane] = ()
        self.clock: RaceClock | None = None
        self._timeline = timeline = Timeline(self._moved)
        self._ticker = Ticker(lambda: post(self._tick))
        keys = gui.add_button_group(
            "Player", ("Play", "Pause", "Step back", "Step"), hint="Step through the iterations."
        )
        actions = {
            "Play": timeline.play,
            "Pause": timeline.pause,
            "Step back": lambda: timeline.step(-1),
            "Step": lambda: timeline.step(1),
        }
        keys.on_click(lambda event: post(self._press, actions[event.target.value]))
        self._scrub = gui.add_slider("Iteration", 0, 1, 1, 0, hint="Drag to any place of the race.")
        changed(self._scrub, self._seek)

    def add_options(self) -> None:
        """Speed, loop and clock."""
        gui, timeline = self._gui, self._timeline
        self._ms = gui.add_dropdown(
            "Axis",
            list(CLOCKS),
            hint="Whether the player and the curves count iterations, or the milliseconds each method took "
            "in this app's computing process, its preparation included.",
        )
        self._changed(self._ms, self._picked_clock)
        speed = gui.add_slider("Speed (1/s)", 1.0, 30.0, 1.0, 4.0, hint="Slider steps a second.")
        self._changed(speed, lambda: setattr(timeline, "speed", speed.value))
        loop = gui.add_checkbox("Loop", False, hint="Begin anew at the end.")
        self._changed(loop, lambda: setattr(timeline, "loop", loop.value))

    @property
    def place(self) -> int:
        """Where the player is."""
        return self._timeline.position

    def close(self) -> None:
        """End the player's thread."""
        self._ticker.close()

    def load(self, lanes: Sequence[RaceLane]) -> None:
        """Take another race, at its start."""
        self._lanes = lanes
        clock = self.clock = RaceClock.of(lanes, CLOCKS[self._ms.value])
        self._scrub.label = "Time (ms)" if clock.in_ms else "Iteration"
        self._scrub.max = max(1, clock.length - 1) * clock.unit
        self._scrub.step = clock.unit
        self._scrub.value = 0
        self._ticker.run(False)
        self._on_clock()
        self._timeline.reset(clock.length)

    def choose(self, in_ms: bool) -> None:
        """Count milliseconds or iterations from the next race on."""
        self._ms.value = next(name for name, value in CLOCKS.items() if value == in_ms)

    def seek(self, at: int | None) -> None:
        """Go to an iteration or millisecond; None is the end."""
        if self.clock is not None:
            self._timeline.seek(self.clock.length - 1 if at is None else at // self.clock.unit)

    def _picked_clock(self) -> None:
        if self._lanes:
            self.load(self._lanes)

    def _press(self, action: Callable[[], None]) -> None:
        action()
        self._ticker.run(self._timeline.playing)

    def _seek(self) -> None:
        self.seek(int(self._scrub.value))

    def _tick(self) -> None:
        self._timeline.tick()
        self._ticker.run(self._timeline.playing)

    def _moved(self, place: int) -> None:
        if self.clock is not None:
            self._scrub.value = place * self.clock.unit
            self._on_place(place)
