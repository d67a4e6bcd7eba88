"""Play, pause, step and scrub over any list of steps; knows no algorithm."""

from __future__ import annotations

import functools
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from app.ui import Ui
from pipeline.types import IntArray

PERIOD_S = 0.1
"""Time between two looks at the clock while playing."""


class Timeline:
    """A cursor over ``length`` steps that moves by itself while it plays.

    The position follows the clock, so a slow viewer skips steps and never falls behind.
    """

    def __init__(self, on_move: Callable[[int], None], clock: Callable[[], float] = time.monotonic) -> None:
        self._on_move = on_move
        self._clock = clock
        self._length = 0
        self._position = 0
        self._speed = 4.0
        self._anchor = (0.0, 0)
        self.loop = False
        self.playing = False

    @property
    def position(self) -> int:
        """Index of the current step; 0 while there are none."""
        return self._position

    @property
    def speed(self) -> float:
        """Steps a second."""
        return self._speed

    @speed.setter
    def speed(self, steps_per_s: float) -> None:
        self._speed = max(steps_per_s, 1e-3)
        self._anchor = (self._clock(), self._position)

    def reset(self, length: int) -> None:
        """Take a new list of ``length`` steps, at its first one and paused."""
        self._length, self._position, self.playing = max(0, length), 0, False
        if self._length:
            self._on_move(0)

    def play(self) -> None:
        """Start moving; from the beginning if the end was reached."""
        if self._length < 2:
            return
        if self._position == self._length - 1:
            self._go(0)
        self.playing = True
        self._anchor = (self._clock(), self._position)

    def pause(self) -> None:
        """Stay."""
        self.playing = False

    def seek(self, position: int) -> None:
        """Jump to a step, not beyond the ends, and play on from there if playing."""
        self._go(position)
        self._anchor = (self._clock(), self._position)

    def tick(self) -> None:
        """Move to where the clock says; stop at the end unless looping."""
        if not self.playing:
            return
        started_s, origin = self._anchor
        position = origin + int((self._clock() - started_s) * self._speed + 1e-9)
        if self.loop:
            position %= self._length
        elif position >= self._length - 1:
            self.playing = False
        self._go(position)

    def _go(self, position: int) -> None:
        position = min(max(position, 0), max(self._length - 1, 0))
        if position != self._position:
            self._position = position
            self._on_move(position)


class Ticker:
    """One thread that calls ``tick`` every ``period_s`` while running, and sleeps otherwise."""

    def __init__(self, tick: Callable[[], None], period_s: float = PERIOD_S) -> None:
        self._tick = tick
        self._period_s = period_s
        self._running = threading.Event()
        self._closed = threading.Event()
        threading.Thread(target=self._loop, name="playback", daemon=True).start()

    def run(self, running: bool) -> None:
        """Start or suspend the calls."""
        if running:
            self._running.set()
        else:
            self._running.clear()

    def close(self) -> None:
        """End the thread for good."""
        self._closed.set()
        self._running.set()

    def _loop(self) -> None:
        while self._running.wait() and not self._closed.wait(self._period_s):
            self._tick()


@dataclass(frozen=True, slots=True)
class Ruler:
    """How the slider counts the positions of the timeline: ``start + unit * (position // every)``."""

    label: str
    start: float = 0
    unit: float = 1
    every: int = 1
    """Positions in one unit; more of them only make the movement smooth."""
    step: float = 1
    """Of the slider."""

    def value(self, position: int) -> float:
        """Of the slider at a position."""
        return round(self.start + self.unit * (position // self.every), 6)

    def position(self, value: float) -> int:
        """Where a value of the slider is."""
        return round((value - self.start) / self.unit) * self.every


class Player:
    """Buttons and a slider over a timeline, and where wanted its speed and a loop."""

    def __init__(
        self,
        ui: Ui,
        on_move: Callable[[int], None],
        ruler: Ruler,
        hint: str,
        buttons: tuple[str, str, str] = ("Step back", "Step", "To the step before or after."),
        period_s: float = PERIOD_S,
    ) -> None:
        """Add the buttons and the slider.

        Args:
            ui: where to add them.
            on_move: called with every new position.
            ruler: what the slider counts.
            hint: of the slider.
            buttons: names of the two that step back and forth, and what they do.
            period_s: time between two pictures while it plays.
        """
        self._ui, self._on_move, self._ruler = ui, on_move, ruler
        self._stops: IntArray = np.zeros(0, int)
        self._timeline = Timeline(self._moved)
        self._ticker = Ticker(lambda: ui.post(self._tick), period_s)
        ui.closers.append(self._ticker.close)
        back, forth, about = buttons
        actions: dict[str, Callable[[], object]] = {
            "Play": self.play,
            "Pause": self.pause,
            back: functools.partial(self.step, -1),
            forth: functools.partial(self.step, 1),
        }
        keys = ui.buttons("Player", actions, about)
        zero = 0 * ruler.unit
        self._slider = ui.gui.add_slider(ruler.label, zero, zero + 1, ruler.step, zero, hint=hint)
        ui.when_changed(self._slider, lambda: self.seek(self._ruler.position(self._slider.value)))
        self._handles = [keys, self._slider]

    def add_speed(
        self,
        ends: tuple[float, float, float],
        value: float,
        hint: str,
        label: str = "Speed (1/s)",
        rate: Callable[[float], float] = float,
        name: Callable[[float], str] | None = None,
    ) -> None:
        """Add a slider of the speed.

        Args:
            ends: least, most and step.
            value: at first.
            hint: of the slider.
            label: of the slider.
            rate: steps of the ruler's ``every`` a second at a value.
            name: label at a value, if it changes.
        """
        least, most, step = ends
        self._rate, self._speed_name = rate, name
        self._speed = self._ui.gui.add_slider(label, least, most, step, value, hint=hint)
        self._ui.when_changed(self._speed, lambda: self.set_speed(self._speed.value))
        self._handles.append(self._speed)

    def add_loop(self) -> None:
        """Add a checkbox that makes it begin again at the end."""
        loop = self._ui.gui.add_checkbox("Loop", False, hint="Begin again at the end.")
        self._ui.when_changed(loop, lambda: setattr(self._timeline, "loop", loop.value))
        self._handles.append(loop)

    @property
    def position(self) -> int:
        """Where it is."""
        return self._timeline.position

    @property
    def speed(self) -> float:
        """Units of the ruler's ``every`` a second."""
        return self._rate(self._speed.value)

    def set_speed(self, value: float) -> None:
        """Set the slider of the speed."""
        self._speed.value = value
        self._timeline.speed = self.speed * self._ruler.every
        if self._speed_name is not None:
            self._speed.label = self._speed_name(value)

    def show(self, visible: bool) -> None:
        """Show or hide all controls."""
        for handle in self._handles:
            handle.visible = visible

    def load(self, length: int, stops: IntArray | None = None, ruler: Ruler | None = None) -> None:
        """Take another timeline, at its start and paused.

        Args:
            length: of the timeline; 0 has nothing to play.
            stops: ascending positions at which the step buttons halt; None for every ``every``-th.
            ruler: what the slider counts from now on.
        """
        self._ticker.run(False)
        self._ruler = ruler = self._ruler if ruler is None else ruler
        self._stops = np.arange(0, length, ruler.every) if stops is None else stops
        self._slider.label = ruler.label
        self._slider.min, self._slider.step = ruler.value(0), ruler.step
        self._slider.max = max(ruler.value(length - 1), ruler.start + ruler.step)
        self._slider.value = ruler.value(0)
        self._timeline.reset(length)

    def play(self) -> None:
        """Start moving."""
        self._timeline.play()
        self._ticker.run(self._timeline.playing)

    def pause(self) -> None:
        """Stay where it is."""
        self._timeline.pause()
        self._ticker.run(False)

    def seek(self, position: int) -> None:
        """Go to a position."""
        self._timeline.seek(position)

    def step(self, count: int) -> None:
        """Pause at the next stop, or at the one before."""
        self.pause()
        if count > 0:
            at = int(np.searchsorted(self._stops, self.position, side="right"))
        else:
            at = int(np.searchsorted(self._stops, self.position)) - 1
        if 0 <= at < len(self._stops):
            self.seek(int(self._stops[at]))

    def _tick(self) -> None:
        self._timeline.tick()
        self._ticker.run(self._timeline.playing)

    def _moved(self, position: int) -> None:
        value = self._ruler.value(position)
        with self._ui.atomic():
            if value != self._slider.value:
                self._slider.value = value
            self._on_move(position)
