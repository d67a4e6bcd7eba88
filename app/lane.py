"""Jobs of which only the newest counts."""

from __future__ import annotations

import threading
from collections.abc import Callable, Hashable
from dataclasses import dataclass, field
from functools import partial
from typing import Any

from app.pool import ComputePool, Outcome, Ticket
from app.state import Step

CANCEL_S = 1.0
"""How long a cancelled job may go on before its process is ended, which costs everybody a new one."""


@dataclass(slots=True)
class LatestWins:
    """A lane of one running and one waiting job; a newer job replaces the waiting one.

    The running job is asked to stop when a newer one arrives. If it ends first its result is still
    delivered, before the newer one's.
    """

    pool: ComputePool
    owner: object
    urgent: bool = False
    """Whether its jobs go before those of other lanes."""
    _running: Ticket | None = None
    _start_waiting: Callable[[], Ticket] | None = None
    _lock: threading.RLock = field(default_factory=threading.RLock)

    @property
    def busy(self) -> bool:
        return self._running is not None

    def submit(
        self,
        function: Callable[..., Any],
        *arguments: Any,
        on_progress: Callable[[Any], None],
        on_end: Callable[[Outcome], None],
        key: Hashable = None,
    ) -> None:
        """Run this job as soon as the one before it is out of the way."""
        start = partial(
            self.pool.submit,
            self.owner,
            function,
            *arguments,
            on_progress=on_progress,
            on_end=partial(self._ended, on_end),
            key=key,
            urgent=self.urgent,
        )
        with self._lock:
            if self._running is None:
                self._running = start()
                return
            self._start_waiting, running = start, self._running
        self.pool.stop(running)

    def stop(self) -> None:
        """Forget the waiting job and ask the running one to stop at its next report."""
        self._stop(None)

    def cancel(self) -> None:
        """Forget the waiting job and have the running one ended within ``CANCEL_S``."""
        self._stop(CANCEL_S)

    def _stop(self, patience_s: float | None) -> None:
        with self._lock:
            self._start_waiting, running = None, self._running
        if running is not None:
            self.pool.stop(running, patience_s)

    def _ended(self, on_end: Callable[[Outcome], None], outcome: Outcome) -> None:
        with self._lock:
            start, self._start_waiting = self._start_waiting, None
            self._running = None if start is None else start()
        on_end(outcome)


@dataclass(slots=True, eq=False)
class Track:
    """Steps that are computed one after the other, beside those of other tracks."""

    lane: LatestWins
    steps: tuple[Step, ...]
    running: Step | None = None
    submitted: tuple[Any, ...] | None = None
    """The key of what is running."""
