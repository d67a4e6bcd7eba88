"""Who gets a session: so many browsers at once, so many of one address, and one begins after the other."""

from __future__ import annotations

import contextlib
import logging
import threading
import time
from collections import Counter
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any

MOST_SESSIONS = 64
MOST_OF_ONE_ADDRESS = 48
"""Sessions; a class behind one router has one address."""
MOST_WAITING, MOST_WAITING_OF_ONE = 64, 32
BUILD_S = 5.0
"""Patience with a session that is built, before the next one is."""
SILENT_S = 60.0
"""A browser that has not shown the page by then goes: its page says so at once."""
LOOK_S = 5.0

logger = logging.getLogger(__name__)


@dataclass(slots=True)
class Visitor:
    """A browser that has come."""

    number: int
    address: str
    begin: Callable[[], Future[Any] | None]
    """Gives it a session, and returns what is done when that is built; None if there is none."""
    wait: Callable[[], None]
    """Tells it that it waits for a place."""
    turn_away: Callable[[], None]
    """Ends its connection."""
    shows_page: Callable[[], bool]
    """Whether its page has said anything yet."""
    began_s: float = 0.0
    """When its session was begun, by the clock of this process."""
    told: bool = False
    """Whether it knows that it waits."""


class Crowd:
    """All that have come, from any thread. One thread begins sessions and looks for silent ones."""

    def __init__(self) -> None:
        self._inside: dict[int, Visitor] = {}
        self._waiting: dict[int, Visitor] = {}
        self._lock = threading.Lock()
        self._thread = ThreadPoolExecutor(1, thread_name_prefix="crowd")
        self._closing = threading.Event()
        threading.Thread(target=self._look, name="crowd-look", daemon=True).start()

    def come(self, visitor: Visitor) -> None:
        """Give a browser a session as soon as there is room; turn it away if too many wait."""
        with self._lock:
            of_one = sum(one.address == visitor.address for one in self._waiting.values())
            room = len(self._waiting) < MOST_WAITING and of_one < MOST_WAITING_OF_ONE
            if room:
                self._waiting[visitor.number] = visitor
        if room:
            self._soon()
        else:
            visitor.turn_away()

    def leave(self, number: int) -> None:
        """A browser is gone; whoever waits for its place gets it."""
        with self._lock:
            self._waiting.pop(number, None)
            self._inside.pop(number, None)
        self._soon()

    def close(self) -> None:
        """Begin nothing more."""
        self._closing.set()
        self._thread.shutdown(wait=False, cancel_futures=True)

    def _soon(self) -> None:
        with contextlib.suppress(RuntimeError):  # closed
            self._thread.submit(self._fill)

    def _fill(self) -> None:
        """Begin a session for everybody for whom there is room, and tell the others that they wait."""
        while (visitor := self._next()) is not None:
            try:
                built = visitor.begin()
                if built is not None:
                    built.result(BUILD_S)
            except TimeoutError:
                pass  # it goes on by itself
            except Exception:  # it may be the only one that cannot begin
                logger.exception("a session could not begin")
        with self._lock:
            waiting = [one for one in self._waiting.values() if not one.told]
        for one in waiting:
            one.told = True
            one.wait()

    def _next(self) -> Visitor | None:
        """Take the first of those who wait whose address has room for one more."""
        with self._lock:
            counts = Counter(one.address for one in self._inside.values())
            if len(self._inside) >= MOST_SESSIONS:
                return None
            for number, visitor in self._waiting.items():
                if counts[visitor.address] < MOST_OF_ONE_ADDRESS:
                    visitor.began_s = time.monotonic()
                    self._inside[number] = self._waiting.pop(number)
                    return visitor
        return None

    def _look(self) -> None:
        while not self._closing.wait(LOOK_S):
            late_s = time.monotonic() - SILENT_S
            with self._lock:
                silent = [one for one in self._inside.values() if one.began_s < late_s]
            for one in silent:
                if not one.shows_page():
                    one.turn_away()
