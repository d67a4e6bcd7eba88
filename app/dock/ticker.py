"""A thread that calls a function at regular intervals during playback."""

from __future__ import annotations

import threading
from collections.abc import Callable


class Ticker:
    """A thread that calls ``tick`` every ``period_s`` seconds while it runs, and sleeps otherwise."""

    def __init__(self, tick: Callable[[], None], period_s: float) -> None:
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
        """End the thread."""
        self._closed.set()
        self._running.set()

    def _loop(self) -> None:
        while self._running.wait() and not self._closed.wait(self._period_s):
            self._tick()
