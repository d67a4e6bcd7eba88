"""Answers that sessions share: one computation and one copy for all, within a limit of memory."""

import threading
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np
import pytest

from app.compute.shared import SharedViews, kept, size_bytes
from app.compute.store import Store

THIRTY = 30


@dataclass(frozen=True)
class View:
    points_m: np.ndarray
    name: str = "view"


def view_of(kilobytes):
    return View(np.zeros(1000 * kilobytes, np.uint8))


@pytest.fixture
def own(tmp_path):
    return Store(str(tmp_path))


def test_thirty_who_ask_at_once_get_one_copy_read_once(own, monkeypatch):
    own.put(kept("key"), view_of(1))
    reads, get, barrier = [], Store.get, threading.Barrier(THIRTY)
    monkeypatch.setattr(Store, "get", lambda store, key: (reads.append(key), get(store, key))[1])
    shared = SharedViews(own)

    def ask(_):
        barrier.wait(10.0)
        return shared.get("key")

    with ThreadPoolExecutor(THIRTY) as sessions:
        views = list(sessions.map(ask, range(THIRTY)))
    assert len({id(view) for view in views}) == 1
    assert reads == [kept("key")]


def test_memory_keeps_the_newest_up_to_a_limit_of_bytes_and_the_store_all(own):
    shared = SharedViews(own, limit_bytes=3500)
    for name in "abc":
        own.put(kept(name), view_of(1))
        shared.put(name, view_of(1))
    used = shared.get("a")
    shared.put("d", view_of(1))  # b has been unused for longest
    assert shared.get("a") is used
    again = shared.get("b")
    assert again is not None
    assert shared.get("b") is again
    assert shared.get("never") is None


def test_one_answer_above_the_limit_is_kept_alone(own):
    shared = SharedViews(own, limit_bytes=3500)
    shared.put("small", view_of(1))
    shared.put("large", view_of(9))
    assert shared.get("small") is None
    assert shared.get("large") is not None


def test_an_answer_that_comes_again_counts_once(own):
    shared = SharedViews(own, limit_bytes=3500)
    for _ in range(5):
        shared.put("same", view_of(1))
    shared.put("other", view_of(2))
    assert shared.get("same") is not None


def test_the_size_of_a_view_is_that_of_what_lies_in_it():
    view = View(np.zeros((10, 3), np.float32), "four")
    assert size_bytes(view) == 124
    assert size_bytes({"after": (view, b"12")}) == 126
    assert size_bytes([None, 1.0]) == 16
