"""A timer that each call restarts; its action runs after the last call."""

from __future__ import annotations

import threading
from collections.abc import Callable


class Debounce:
    """Calls ``action`` on its own thread when ``wait_s`` seconds have passed since the last ``restart``."""

    def __init__(self, wait_s: float, action: Callable[[], None]) -> None:
        self._wait_s, self._action = wait_s, action
        self._timer: threading.Timer | None = None

    @property
    def pending(self) -> bool:
        """Whether the action has yet to run."""
        return self._timer is not None and self._timer.is_alive()

    def restart(self) -> None:
        """Start the waiting time again."""
        self.cancel()
        self._timer = threading.Timer(self._wait_s, self._action)
        self._timer.daemon = True
        self._timer.start()

    def cancel(self) -> None:
        """Cancel the action."""
        if self._timer is not None:
            self._timer.cancel()
        self._timer = None
