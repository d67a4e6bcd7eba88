"""Lanes of jobs in which a newer job replaces the older ones."""

from __future__ import annotations

import threading
from collections.abc import Callable, Hashable
from dataclasses import dataclass, field
from functools import partial
from typing import Any

from app.compute.pool import ComputePool, Outcome, Ticket
from app.compute.state import Step

CANCEL_S = 1.0
"""Time that a cancelled job gets before its process is killed and a new one starts, seconds."""


@dataclass(frozen=True, slots=True)
class _Waiting:
    """A job that starts when the running job of its lane has ended."""

    start: Callable[[], Ticket]
    on_end: Callable[[Outcome], None]


@dataclass(slots=True)
class LatestWins:
    """A lane of one running and one waiting job; a newer job replaces the waiting one.

    The running job is asked to stop when a newer one arrives. If it completes before it stops, its result is
    still delivered, before the newer job's result.
    """

    pool: ComputePool
    owner: object
    urgent: bool = False
    """Whether the jobs of this lane start before waiting jobs of lanes that are not urgent."""
    _running: Ticket | None = None
    _waiting: _Waiting | None = None
    _lock: threading.RLock = field(default_factory=threading.RLock)

    @property
    def busy(self) -> bool:
        """Whether a job runs."""
        return self._running is not None

    def submit(
        self,
        function: Callable[..., Any],
        *arguments: Any,
        on_progress: Callable[[Any], None],
        on_end: Callable[[Outcome], None],
        key: Hashable = None,
    ) -> None:
        """Start this job, or make it the waiting job and ask the running one to stop.

        ``on_end`` of a waiting job that this one replaces is not called.
        """
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
        """Drop the waiting job without a call of its ``on_end``, and ask the running one to stop."""
        self._stop(None)

    def cancel(self) -> None:
        """Stop the running job within ``CANCEL_S`` and report the waiting one as stopped."""
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


class UrgentLanes(dict[str, LatestWins]):
    """An urgent lane for each kind of job, so that a job replaces only an earlier one of its own kind."""

    def __init__(self, pool: ComputePool) -> None:
        self._pool = pool

    def __missing__(self, kind: str) -> LatestWins:
        lane = self[kind] = LatestWins(self._pool, object(), urgent=True)
        return lane


@dataclass(frozen=True, slots=True, eq=False)
class Submission:
    """One submission of a step to its lane, compared by identity.

    A step can be submitted again while the job of its earlier submission is still stopping.
    """

    step: Step
    key: tuple[Any, ...]
    """Everything that the step's result depends on."""


@dataclass(slots=True, eq=False)
class Track:
    """Steps that are computed one after the other, in parallel with the steps of other tracks."""

    lane: LatestWins
    steps: tuple[Step, ...]
    submitted: Submission | None = None
    """The submission that runs or waits for the one before it to stop."""

    @property
    def running(self) -> Step | None:
        """The submitted step; None if there is none."""
        return None if self.submitted is None else self.submitted.step
