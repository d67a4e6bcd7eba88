"""Run heavy jobs in long-lived processes outside the server, so that no browser waits for another's job.

Open3D holds the interpreter lock, so the server process computes nothing itself. A job is a module-level
function and its arguments. If the function returns a generator, each value that it yields is sent as a
progress report, and the job can be stopped between two yields.
"""

from __future__ import annotations

import logging
import multiprocessing
import os
import threading
import time
from collections.abc import Callable, Hashable, Iterator
from dataclasses import dataclass, field
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from typing import Any, Literal

import psutil

from app.compute.child import TRY_SMALLER, attend

logger = logging.getLogger(__name__)

PATIENCE_S = 3.0
"""Time that a superseded job gets to stop before its process is killed, seconds."""
RESPAWN_PAUSE_S = 1.0
"""Pause before a process is started that replaces one that died at its start or grew too large, seconds."""
MEMORY_LIMIT_BYTES = 2 << 30
"""Memory limit of a process: one that holds more after a job is replaced by a new process."""
DIED = f"The computing process ended unexpectedly, perhaps out of memory: {TRY_SMALLER}"


@dataclass(frozen=True, slots=True)
class Outcome:
    """Outcome of a job: a result, an error, or neither because it was stopped."""

    kind: Literal["result", "error", "stopped"]
    value: Any = None
    """The result, or the error as a sentence; None if the job was stopped."""


@dataclass(slots=True, eq=False)
class Ticket:
    """A submitted job, until it ends."""

    owner: object
    """The object on whose behalf the job runs; the pool never runs two jobs of one owner at once."""
    function: Callable[..., Any]
    arguments: tuple[Any, ...]
    on_progress: Callable[[Any], None]
    on_end: Callable[[Outcome], None]
    key: Hashable = None
    """Everything that the result depends on: jobs with equal keys are computed once, those without each."""
    urgent: bool = False
    """Whether the job starts before waiting jobs that are not urgent."""
    ahead: bool = False
    """Whether no session waits for the job yet. Such a job starts only while no other kind of job runs or
    waits and a second process is free. It is asked to stop when a job that is not ahead and has another key
    is submitted."""
    stopping: bool = False


@dataclass(slots=True, eq=False)
class _Slot:
    """One process of the pool and the job that it runs."""

    process: BaseProcess | None = None
    connection: Connection | None = None
    ticket: Ticket | None = None
    ready: bool = False
    next_may_start: threading.Event = field(default_factory=threading.Event)
    """Set when the next process may start: this one has warmed up or died, or more jobs wait than there are
    ready processes. Until then its imports would slow down the first job."""


def _nothing() -> Iterator[None]:
    yield from ()


class ComputePool:
    """Spawned processes that run jobs in the order of submission, one job of each owner at once.

    Jobs with equal keys are computed once: a job whose key is being computed waits and gets that result.
    """

    def __init__(
        self,
        size: int = 2,
        warm_up: Callable[[], Iterator[None]] = _nothing,
        patience_s: float = PATIENCE_S,
    ) -> None:
        """Start the first process; each further one starts when the one before it is warm, or when jobs wait.

        Each process runs ``warm_up`` to its first yield before any job, and the later parts between jobs.
        """
        self._context = multiprocessing.get_context("spawn")
        self._warm_up = warm_up
        self._patience_s = patience_s
        self._threads_each = max(1, (os.cpu_count() or 1) // size)
        self._lock = threading.Lock()
        self._waiting: list[Ticket] = []
        self._last_used_s = time.monotonic()
        self._closed = False
        self._closing = threading.Event()
        self._slots = [_Slot() for _ in range(size)]
        self._threads = [
            threading.Thread(target=self._attend, args=pair, name=f"compute-{i}", daemon=True)
            for i, pair in enumerate(zip(self._slots, [None, *self._slots[:-1]], strict=True))
        ]
        for thread in self._threads:
            thread.start()

    def submit(
        self,
        owner: object,
        function: Callable[..., Any],
        *arguments: Any,
        on_progress: Callable[[Any], None],
        on_end: Callable[[Outcome], None],
        key: Hashable = None,
        urgent: bool = False,
        ahead: bool = False,
    ) -> Ticket:
        """Queue a job. The callbacks run on a thread of the pool and must return quickly.

        Raises:
            RuntimeError: the pool is closed.
        """
        ticket = Ticket(owner, function, arguments, on_progress, on_end, key, urgent, ahead)
        with self._lock:
            if self._closed:
                raise RuntimeError("the pool is closed")
            self._waiting.append(ticket)
            if not ahead:
                self._make_way()
            self._dispatch()
        return ticket

    def idle_s(self) -> float:
        """Return the time since a job last ran or waited, seconds; jobs ahead do not count."""
        with self._lock:
            return 0.0 if self._in_use() else time.monotonic() - self._last_used_s

    def stop(self, ticket: Ticket, patience_s: float | None = None) -> None:
        """Drop a waiting job, or ask a running one to stop at its next progress report.

        After ``patience_s`` (None: the pool's) its process is killed. A job that has ended is ignored.
        """
        if self._withdraw(ticket):
            return
        with self._lock:
            slot = self._slot_of(ticket)
            if slot is None or ticket.stopping:
                return
            ticket.stopping = True
            _send(slot, ("stop", None))
        patience_s = self._patience_s if patience_s is None else patience_s
        timer = threading.Timer(patience_s, self._end_process, (ticket,))
        timer.daemon = True
        timer.start()

    def _end_process(self, ticket: Ticket) -> None:
        """Kill the process of a job if the job still runs."""
        with self._lock:
            slot = self._slot_of(ticket)
            if slot is not None and slot.process is not None:
                slot.process.terminate()

    def running(self) -> list[object]:
        """Return the owners of the running jobs."""
        with self._lock:
            return [slot.ticket.owner for slot in self._slots if slot.ticket is not None]

    def close(self) -> None:
        """Stop all processes; jobs that have not ended are reported as stopped."""
        with self._lock:
            self._closed = True
            self._closing.set()
            waiting, self._waiting = self._waiting, []
            for slot in self._slots:
                slot.next_may_start.set()
                if slot.process is not None:
                    slot.process.terminate()
        for ticket in waiting:
            _run_callback(ticket.on_end, Outcome("stopped"))
        for thread in self._threads:
            thread.join(timeout=5.0)

    def _withdraw(self, ticket: Ticket) -> bool:
        """Drop a job that has not started. Returns False if it has started."""
        with self._lock:
            if ticket not in self._waiting:
                return False
            self._waiting.remove(ticket)
            self._note_use(ticket)
        _run_callback(ticket.on_end, Outcome("stopped"))
        return True

    def _slot_of(self, ticket: Ticket) -> _Slot | None:
        return next((slot for slot in self._slots if slot.ticket is ticket), None)

    def _dispatch(self) -> None:
        """Give waiting jobs to free processes; let further processes start if jobs remain.

        The caller holds the lock.
        """
        for slot in self._slots:
            if slot.ticket is not None or not slot.ready:
                continue
            free = self._free()
            if not free:
                return
            ticket = next((one for one in free if one.urgent), free[0])
            self._waiting.remove(ticket)
            slot.ticket = ticket
            _send(slot, ("job", (ticket.function, ticket.arguments)))
        if self._free():
            for slot in self._slots:
                if slot.ready:
                    slot.next_may_start.set()

    def _free(self) -> list[Ticket]:
        """Return the jobs that may start now. The caller holds the lock.

        A job does not start while another job of its owner runs, or waits for the result of a running job
        with the same key.
        """
        running = [slot.ticket for slot in self._slots if slot.ticket is not None]
        keys = {one.key for one in running} - {None}
        served = [one for one in self._waiting if one.key in keys]
        owners = {id(one.owner) for one in (*running, *served)}
        free = [one for one in self._waiting if id(one.owner) not in owners and one not in served]
        idle = sum(slot.ready and slot.ticket is None for slot in self._slots)
        return [one for one in free if not one.ahead or (idle > 1 and not self._in_use())]

    def _in_use(self) -> bool:
        """Return whether a job that is not ahead runs or waits. The caller holds the lock."""
        running = [slot.ticket for slot in self._slots if slot.ticket is not None]
        return not all(one.ahead for one in (*running, *self._waiting))

    def _make_way(self) -> None:
        """Stop the jobs ahead whose result no waiting job needs. The caller holds the lock."""
        needed = {one.key for one in self._waiting if not one.ahead} - {None}
        for slot in self._slots:
            if slot.ticket is not None and slot.ticket.ahead and slot.ticket.key not in needed:
                slot.ticket.stopping = True
                _send(slot, ("stop", None))

    def _attend(self, slot: _Slot, before: _Slot | None) -> None:
        """Keep one process alive and handle its messages until the pool closes.

        It starts once the process of the slot ``before`` allows it (``next_may_start``).
        """
        if before is not None:
            before.next_may_start.wait()
        while not self._closed:
            if not self._start(slot):
                self._closing.wait(RESPAWN_PAUSE_S)
                continue
            assert slot.connection is not None
            assert slot.process is not None
            try:
                while True:
                    self._on_message(slot, *slot.connection.recv())
            except (EOFError, OSError):
                slot.process.join(timeout=2.0)
            except Exception:
                logger.exception("a report of the computing process could not be read")
                slot.process.kill()
            if not slot.ready:
                self._closing.wait(RESPAWN_PAUSE_S)
            self._on_death(slot)

    def _start(self, slot: _Slot) -> bool:
        """Start a process. Returns False if the pool is closed or the system has no process to give."""
        with self._lock:
            if self._closed:
                return False
            try:
                here, there = self._context.Pipe()
                slot.process = self._context.Process(
                    target=attend, args=(there, self._warm_up, self._threads_each), daemon=True
                )
                slot.process.start()
            except OSError:
                logger.warning("a computing process could not be started; it is tried again")
                slot.process = None
                return False
            there.close()
            slot.connection = here
            return True

    def _on_message(self, slot: _Slot, kind: str, value: Any) -> None:
        ticket = slot.ticket
        if kind == "warm":
            slot.next_may_start.set()
            return
        if kind == "progress" and ticket is not None:
            with self._lock:
                others = self._others(ticket)
            for one in (ticket, *others):
                _run_callback(one.on_progress, value)
            return
        with self._lock:
            slot.ready, slot.ticket = True, None
            ended = self._ended(ticket, kind)
            if kind != "ready" and _memory_bytes(slot.process) > MEMORY_LIMIT_BYTES:
                slot.ready = False
                assert slot.process is not None
                slot.process.terminate()
            self._dispatch()
        for one in ended:
            _run_callback(one.on_end, Outcome(kind, value))  # type: ignore[arg-type]

    def _others(self, ticket: Ticket) -> list[Ticket]:
        """Return the waiting jobs with the same key. The caller holds the lock."""
        return [one for one in self._waiting if one.key is not None and one.key == ticket.key]

    def _ended(self, ticket: Ticket | None, kind: str) -> list[Ticket]:
        """Return the job that has ended, if any, and the waiting jobs that it also answers, which no longer
        wait. The caller holds the lock."""
        if ticket is None:
            return []
        others = [] if kind == "stopped" else self._others(ticket)
        self._waiting = [one for one in self._waiting if one not in others]
        self._note_use(ticket, *others)
        return [ticket, *others]

    def _note_use(self, *ended: Ticket) -> None:
        """Start the idle time when these jobs end, unless all are ahead. The caller holds the lock."""
        if not all(one.ahead for one in ended):
            self._last_used_s = time.monotonic()

    def _on_death(self, slot: _Slot) -> None:
        """End the job of a process that has died: as stopped if it was asked to stop, else with an error."""
        with self._lock:
            ticket, slot.ticket = slot.ticket, None
            slot.ready = False
            slot.next_may_start.set()
            if slot.connection is not None:
                slot.connection.close()
            stopped = self._closed or (ticket is not None and ticket.stopping)
            outcome = Outcome("stopped") if stopped else Outcome("error", DIED)
            ended = self._ended(ticket, outcome.kind)
        for one in ended:
            _run_callback(one.on_end, outcome)


def _send(slot: _Slot, message: tuple[str, Any]) -> None:
    """Send a message to a process. If the process has just died, its attending thread will notice."""
    try:
        assert slot.connection is not None
        slot.connection.send(message)
    except OSError:
        logger.debug("the computing process is gone")


def _run_callback(callback: Callable[[Any], None], argument: Any) -> None:
    """Call a callback; its errors are logged, so that they do not end the attending thread."""
    try:
        callback(argument)
    except Exception:
        logger.exception("a callback of a job failed")


def _memory_bytes(process: BaseProcess | None) -> int:
    try:
        return psutil.Process(process.pid).memory_info().rss if process is not None else 0
    except psutil.Error:
        return 0
