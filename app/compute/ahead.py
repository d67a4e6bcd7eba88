"""Compute what will probably be asked for: the chain of the start settings, then likely answers at rest."""

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
"""Time without any job after which work ahead begins, seconds: a page that just got its surface draws it."""
LOOK_S = 0.5
"""Time between two looks at whether it may begin."""


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
class Wish:
    """A job whose answer somebody may ask for."""

    key: Hashable
    """What the answer depends on, as sessions ask for it."""
    function: Callable[..., Any]
    """``app.compute.jobs.run_step`` or ``run_kept``, so that the answer is kept in the store."""
    arguments: tuple[Any, ...]


class WorkAhead:
    """Has wishes computed one after the other while nobody asks for anything; ends with the last of them."""

    def __init__(self, pool: ComputePool, store: Store) -> None:
        self._pool, self._store = pool, store
        self._plan: Hashable = None
        self._wishes: deque[Wish] = deque()
        self._lock, self._ended = threading.Lock(), threading.Event()
        self._closing = threading.Event()
        self._thread: threading.Thread | None = None

    @property
    def done(self) -> bool:
        """Whether there was a plan and nothing of it is left to compute."""
        return self._plan is not None and self._thread is None

    def plan(self, name: Hashable, wishes: Callable[[], Iterable[Wish]]) -> None:
        """Compute these wishes in place of those before, unless they are the ones of this name already."""
        with self._lock:
            if name == self._plan or self._closing.is_set():
                return
            self._plan = name
            self._wishes = deque(wishes())
            if self._thread is None:
                self._thread = threading.Thread(target=self._work, name="ahead", daemon=True)
                self._thread.start()

    def close(self) -> None:
        """Begin nothing more."""
        self._closing.set()
        self._ended.set()

    def _work(self) -> None:
        while not self._closing.is_set():
            with self._lock:
                if not self._wishes:
                    self._thread = None
                    return
                wish = self._wishes[0]
            if self._store.has(kept(wish.key)):
                self._drop(wish)
            elif self._pool.idle_s() < REST_S or _on_battery():
                self._closing.wait(LOOK_S)
            elif self._compute(wish):
                self._drop(wish)

    def _compute(self, wish: Wish) -> bool:
        """Return whether the job ended by itself, with or without an answer; a stopped one is begun again."""
        ends: list[str] = []

        def ended(outcome: Outcome) -> None:
            ends.append(outcome.kind)
            self._ended.set()

        self._ended.clear()
        try:
            self._pool.submit(
                self,
                wish.function,
                *wish.arguments,
                on_progress=lambda _: None,
                on_end=ended,
                key=wish.key,
                ahead=True,
            )
        except RuntimeError:  # the pool is closed
            self._closing.set()
            return True
        self._ended.wait()
        return ends != ["stopped"]

    def _drop(self, wish: Wish) -> None:
        """Remove a wish that is still the first: there may be another plan by now."""
        with self._lock:
            if self._wishes and self._wishes[0] is wish:
                self._wishes.popleft()


def _on_battery() -> bool:
    """Return whether this computer draws on its battery; False if that is not known."""
    try:
        battery = psutil.sensors_battery()
    except (AttributeError, OSError, RuntimeError):  # a system without such sensors
        return False
    return battery is not None and battery.power_plugged is False
