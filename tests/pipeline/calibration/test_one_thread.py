"""The number of OpenCV's threads is one inside, and afterwards what it was."""

from concurrent.futures import ThreadPoolExecutor
from threading import Event

import cv2
import pytest

from pipeline.calibration.one_thread import one_thread


@pytest.fixture
def two_threads():
    before = cv2.getNumThreads()
    cv2.setNumThreads(2)
    yield
    cv2.setNumThreads(before)


@pytest.mark.usefixtures("two_threads")
def test_two_calibrations_at_once_take_turns_and_leave_as_many_threads_as_before():
    inside = Event()

    def other():
        with one_thread():
            inside.set()
            return cv2.getNumThreads()

    with ThreadPoolExecutor(1) as pool:
        with one_thread():
            second = pool.submit(other)
            assert not inside.wait(0.2)
            assert cv2.getNumThreads() == 1
        assert second.result() == 1
    assert cv2.getNumThreads() == 2
