"""Limits on the number of browsers, in all and per address, and a queue that starts sessions one by one."""

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
"""Most sessions of one network address; a class behind one router has one address."""
MOST_WAITING, MOST_WAITING_OF_ONE = 64, 32
BUILD_S = 5.0
"""Longest wait for a session to be built before the next one starts, seconds."""
NO_PAGE_S = 60.0
"""Time from the start of its session after which a browser that has not shown the page is disconnected,
seconds. A page reports at once."""
LOOK_S = 5.0
"""Time between two searches for such browsers, seconds."""

logger = logging.getLogger(__name__)


@dataclass(slots=True)
class Visitor:
    """A connected browser."""

    number: int
    address: str
    begin: Callable[[], Future[Any] | None]
    """Starts its session. Returns a future that is done when the session is built; None without one."""
    wait: Callable[[], None]
    """Shows a note in the browser that it waits for a place."""
    turn_away: Callable[[], None]
    """Closes its connection."""
    shows_page: Callable[[], bool]
    """Whether its page has sent anything yet."""
    began_s: float = 0.0
    """Time at which its session started, on this process's monotonic clock, seconds."""
    shows_waiting: bool = False
    """Whether the browser shows that it waits."""


class Crowd:
    """All connected browsers, usable on any thread. One thread starts sessions, one finds silent browsers."""

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
        """Remove a browser that has gone; its place goes to the next one that waits."""
        with self._lock:
            self._waiting.pop(number, None)
            self._inside.pop(number, None)
        self._soon()

    def close(self) -> None:
        """Start no more sessions."""
        self._closing.set()
        self._thread.shutdown(wait=False, cancel_futures=True)

    def _soon(self) -> None:
        with contextlib.suppress(RuntimeError):  # closed
            self._thread.submit(self._fill)

    def _fill(self) -> None:
        """Start a session for every browser that has room, and tell the others that they wait."""
        while (visitor := self._next()) is not None:
            try:
                built = visitor.begin()
                if built is not None:
                    built.result(BUILD_S)
            except TimeoutError:
                pass  # it continues to build
            except Exception:  # the failure may concern only this one
                logger.exception("a session could not begin")
                visitor.turn_away()
        with self._lock:
            waiting = [one for one in self._waiting.values() if not one.shows_waiting]
        for one in waiting:
            one.shows_waiting = True
            one.wait()

    def _next(self) -> Visitor | None:
        """Give a place to the first waiting browser whose address has room. Returns it; None without one."""
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
        """Disconnect the browsers that have shown no page within ``NO_PAGE_S``, until the crowd is closed."""
        while not self._closing.wait(LOOK_S):
            late_s = time.monotonic() - NO_PAGE_S
            with self._lock:
                silent = [one for one in self._inside.values() if one.began_s < late_s]
            for one in silent:
                if not one.shows_page():
                    one.turn_away()
