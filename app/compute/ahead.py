"""Compute results before a session needs them: first the start settings' chain, later likely jobs."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable, Hashable, Iterable
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from typing import Any

import psutil

from app.compute import jobs
from app.compute.pool import ComputePool, Outcome
from app.compute.shared import SharedViews, kept
from app.compute.state import CHAIN, Spec, Step
from app.compute.store import Store

REST_S = 3.0
"""Time without any job after which work ahead begins, seconds, so that pages draw a new surface first."""
LOOK_S = 0.5
"""Time between two checks of whether work ahead may begin, seconds."""


def compute_ahead(pool: ComputePool, store: Store, shared: SharedViews, spec: Spec, owner: object) -> None:
    """Start computing the chain and return at once. Sessions find each view in ``shared`` or wait for it.

    A failed step is not reported here: the first session that needs it tries it again and shows the error.
    """
    steps = iter(CHAIN)

    def begin_next() -> None:
        for step in steps:
            view = shared.get(spec.key(step))
            if view is None:
                begin(step)
                return
            if step == "surface":
                shared.on_surface(spec, view)

    def begin(step: Step) -> None:
        with suppress(RuntimeError):  # the pool is closed
            pool.submit(
                owner,
                jobs.run_step,
                step,
                store,
                spec,
                on_progress=lambda _: None,
                on_end=partial(ended, step),
                key=spec.key(step),
            )

    def ended(step: Step, outcome: Outcome) -> None:
        if outcome.kind == "result":
            shared.put(spec.key(step), outcome.value)
            if step == "surface":
                shared.on_surface(spec, outcome.value)
            begin_next()

    begin_next()


@dataclass(frozen=True, slots=True)
class LikelyJob:
    """A job whose answer a session will probably need."""

    key: Hashable
    """Everything that the answer depends on: the key by which sessions look it up."""
    function: Callable[..., Any]
    """``app.compute.jobs.run_step`` or ``run_kept``, so that the answer is kept in the store."""
    arguments: tuple[Any, ...]


class WorkAhead:
    """Computes likely jobs one after the other while no session needs the pool; stops after the last."""

    def __init__(self, pool: ComputePool, store: Store) -> None:
        self._pool, self._store = pool, store
        self._plan: Hashable = None
        self._likely: deque[LikelyJob] = deque()
        self._lock, self._ended = threading.Lock(), threading.Event()
        self._closing = threading.Event()
        self._thread: threading.Thread | None = None

    @property
    def done(self) -> bool:
        """Whether there was a plan and nothing of it is left to compute."""
        return self._plan is not None and self._thread is None

    def plan(self, name: Hashable, likely: Callable[[], Iterable[LikelyJob]]) -> None:
        """Compute the jobs of ``likely()`` instead of those of the present plan, unless it has this name."""
        with self._lock:
            if name == self._plan or self._closing.is_set():
                return
            self._plan = name
            self._likely = deque(likely())
            if self._thread is None:
                self._thread = threading.Thread(target=self._work, name="ahead", daemon=True)
                self._thread.start()

    def close(self) -> None:
        """Start no further job."""
        self._closing.set()
        self._ended.set()

    def _work(self) -> None:
        while not self._closing.is_set():
            with self._lock:
                if not self._likely:
                    self._thread = None
                    return
                likely = self._likely[0]
            if self._store.has(kept(likely.key)):
                self._drop(likely)
            elif self._pool.idle_s() < REST_S or _on_battery():
                self._closing.wait(LOOK_S)
            elif self._compute(likely):
                self._drop(likely)

    def _compute(self, likely: LikelyJob) -> bool:
        """Compute a job. Returns False if the pool stopped it, so that it must start again."""
        ends: list[str] = []

        def ended(outcome: Outcome) -> None:
            ends.append(outcome.kind)
            self._ended.set()

        self._ended.clear()
        try:
            self._pool.submit(
                self,
                likely.function,
                *likely.arguments,
                on_progress=lambda _: None,
                on_end=ended,
                key=likely.key,
                ahead=True,
            )
        except RuntimeError:  # the pool is closed
            self._closing.set()
            return True
        self._ended.wait()
        return ends != ["stopped"]

    def _drop(self, likely: LikelyJob) -> None:
        """Remove a job if it is still the first; another plan may have replaced it."""
        with self._lock:
            if self._likely and self._likely[0] is likely:
                self._likely.popleft()


def _on_battery() -> bool:
    """Return whether this computer draws on its battery; False if that is not known."""
    try:
        battery = psutil.sensors_battery()
    except (AttributeError, OSError, RuntimeError):  # a system without such sensors
        return False
    return battery is not None and battery.power_plugged is False
