"""Let sessions draw one after the other.

Building a panel or drawing a view keeps the interpreter busy for a tenth of a second. If thirty sessions do
so at once, they all wait for the same locks, and so does every click in every browser.
"""

from __future__ import annotations

import contextlib
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor

LONGEST_S = 5.0
"""Time after which the next session may draw although this one is still drawing, seconds."""


class Turns:
    """A queue in which sessions wait to draw; a waiting session still answers clicks."""

    def __init__(self) -> None:
        self._drawing = threading.Lock()
        self._thread = ThreadPoolExecutor(1, thread_name_prefix="turns")

    def give(self, begin: Callable[[], Future[None] | None]) -> None:
        """Queue ``begin``, which starts a drawing and returns its future, or None if nothing is to be drawn.

        The next in the queue is called when that future is done, or after ``LONGEST_S``.
        """
        with contextlib.suppress(RuntimeError):  # the program is ending
            self._thread.submit(self._wait, begin)

    @contextlib.contextmanager
    def taken(self) -> Iterator[None]:
        """Context in which this thread draws: it waits for the present drawing; then the queue waits."""
        with self._drawing:
            yield

    def _wait(self, begin: Callable[[], Future[None] | None]) -> None:
        with self._drawing:
            drawn = begin()
            if drawn is not None:
                with contextlib.suppress(TimeoutError):
                    drawn.result(LONGEST_S)
