"""OpenCV's estimates on one thread. On several it sums the views in varying order, and the last bits differ
between runs.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from threading import Lock

import cv2

_one_at_a_time = Lock()
"""OpenCV has one number of threads for the whole process."""


@contextmanager
def one_thread() -> Iterator[None]:
    """Restrict OpenCV to one thread in the body, which one caller at a time runs. One thread is as fast."""
    with _one_at_a_time:
        threads = cv2.getNumThreads()
        cv2.setNumThreads(1)
        try:
            yield
        finally:
            cv2.setNumThreads(threads)
