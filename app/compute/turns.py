"""Sessions that draw one after the other.

To build a panel or to draw a view takes a tenth of a second of the interpreter. Thirty sessions that do it
at once all wait for the same locks, and every click of anybody waits with them.
"""

from __future__ import annotations

import contextlib
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor

LONGEST_S = 5.0
"""A session that draws for longer lets the next one begin."""


class Turns:
    """Who draws now; a session that waits for its turn goes on answering clicks."""

    def __init__(self) -> None:
        self._drawing = threading.Lock()
        self._thread = ThreadPoolExecutor(1, thread_name_prefix="turns")

    def give(self, begin: Callable[[], Future[None] | None]) -> None:
        """Have something begun when those before it are done; ``begin`` says what to wait for."""
        with contextlib.suppress(RuntimeError):  # the program ends
            self._thread.submit(self._wait, begin)

    @contextlib.contextmanager
    def taken(self) -> Iterator[None]:
        """While this thread draws, nobody else does."""
        with self._drawing:
            yield

    def _wait(self, begin: Callable[[], Future[None] | None]) -> None:
        with self._drawing:
            drawn = begin()
            if drawn is not None:
                with contextlib.suppress(TimeoutError):
                    drawn.result(LONGEST_S)
