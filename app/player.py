"""Play, pause, step and scrub over any list of steps; knows no algorithm."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable

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
    def length(self) -> int:
        return self._length

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
        self.playing = False

    def step(self, count: int) -> None:
        """Pause, then move ``count`` steps, backwards if negative, not beyond the ends."""
        self.playing = False
        self._go(self._position + count)

    def seek(self, position: int) -> None:
        """Jump to a step, and play on from there if playing."""
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
