"""Jobs of which only the newest counts."""

from __future__ import annotations

import threading
from collections.abc import Callable, Hashable
from dataclasses import dataclass, field
from functools import partial
from typing import Any

from app.compute.pool import ComputePool, Outcome, Ticket
from app.compute.state import Step

CANCEL_S = 1.0
"""How long a cancelled job may go on before its process is ended, which costs everybody a new one."""


@dataclass(frozen=True, slots=True)
class _Waiting:
    """A job that begins when the one before it has ended."""

    start: Callable[[], Ticket]
    on_end: Callable[[Outcome], None]


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
    _waiting: _Waiting | None = None
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
            self._waiting, running = _Waiting(start, on_end), self._running
        self.pool.stop(running)

    def stop(self) -> None:
        """Forget the waiting job and ask the running one to stop at its next report."""
        self._stop(None)

    def cancel(self) -> None:
        """Have the running job ended within ``CANCEL_S``, and tell the waiting one that it does not begin."""
        waiting = self._stop(CANCEL_S)
        if waiting is not None:
            waiting.on_end(Outcome("stopped"))

    def _stop(self, patience_s: float | None) -> _Waiting | None:
        with self._lock:
            waiting, self._waiting, running = self._waiting, None, self._running
        if running is not None:
            self.pool.stop(running, patience_s)
        return waiting

    def _ended(self, on_end: Callable[[Outcome], None], outcome: Outcome) -> None:
        with self._lock:
            waiting, self._waiting = self._waiting, None
            self._running = None if waiting is None else waiting.start()
        on_end(outcome)


@dataclass(frozen=True, slots=True, eq=False)
class Submission:
    """One time that a step was handed to its lane; the same step may be again, while this one is stopping."""

    step: Step
    key: tuple[Any, ...]


@dataclass(slots=True, eq=False)
class Track:
    """Steps that are computed one after the other, beside those of other tracks."""

    lane: LatestWins
    steps: tuple[Step, ...]
    submitted: Submission | None = None
    """What is running, or waits for the one before it to stop."""

    @property
    def running(self) -> Step | None:
        """The step that is computed now."""
        return None if self.submitted is None else self.submitted.step
