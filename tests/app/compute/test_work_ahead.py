"""Work ahead of what people ask for: once for all of them, and never in their way."""

import sys
import threading
from pathlib import Path
from types import SimpleNamespace

import pytest

sys.path.insert(0, str(Path(__file__).parent))
import pool_jobs as jobs
from test_pool import Inbox, wait_for

from app.compute import ahead
from app.compute.ahead import LikelyJob, WorkAhead
from app.compute.pool import DIED, ComputePool, Outcome
from app.compute.shared import kept
from app.compute.store import Store

PATIENCE_S = 30.0


@pytest.fixture(scope="module")
def pool():
    pool = ComputePool(size=2)
    inboxes = [Inbox(), Inbox()]
    for owner, inbox in enumerate(inboxes):  # both processes run
        pool.submit(owner, jobs.count, 1, **inbox.callbacks())
    for inbox in inboxes:
        inbox.end()
    yield pool
    pool.close()


def happens(fact):
    for _ in range(int(PATIENCE_S / 0.02)):
        if fact():
            return True
        threading.Event().wait(0.02)
    return False


def both_ready(pool):
    return happens(lambda: all(slot.ready and slot.ticket is None for slot in pool._slots))


def test_thirty_who_ask_for_the_same_have_it_computed_once(pool, tmp_path):
    inboxes = [Inbox() for _ in range(30)]
    for number, inbox in enumerate(inboxes):
        pool.submit(
            f"session {number}",
            jobs.report_and_note,
            str(tmp_path),
            f"run{number}",
            key="equal",
            **inbox.callbacks(),
        )
    (tmp_path / "go").touch()
    answers = [inbox.end() for inbox in inboxes]
    assert len(list(tmp_path.glob("run*"))) == 1
    assert {answer.kind for answer in answers} == {"result"}
    assert len({answer.value for answer in answers}) == 1


def test_a_request_stops_work_ahead_and_does_not_wait_for_it(pool, tmp_path):
    assert both_ready(pool)
    likely, asked = Inbox(), Inbox()
    pool.submit("ahead", jobs.count_forever, str(tmp_path), key="likely", ahead=True, **likely.callbacks())
    wait_for(tmp_path / "began")
    assert pool.idle_s() > 0.0
    pool.submit("person", jobs.count, 1, key="asked", **asked.callbacks())
    assert asked.end() == Outcome("result", 1)
    assert likely.end().kind == "stopped"
    assert (tmp_path / "tidied").exists()


def test_a_request_for_what_is_computed_ahead_gets_that(pool, tmp_path):
    assert both_ready(pool)
    likely, asked, other = Inbox(), Inbox(), Inbox()
    pool.submit(
        "ahead", jobs.report_and_note, str(tmp_path), "ahead", key="same", ahead=True, **likely.callbacks()
    )
    wait_for(tmp_path / "ahead")
    pool.submit("person", jobs.count, 1, key="same", **asked.callbacks())
    pool.submit("other", jobs.count, 2, key="other", **other.callbacks())  # somebody needs it now: it goes on
    assert other.end() == Outcome("result", 2)
    (tmp_path / "go").touch()
    assert asked.end() == likely.end() == Outcome("result", "ahead")


def test_idle_time_begins_when_a_request_ends_however_it_ends(pool, monkeypatch, tmp_path):
    """Withdrawn, answered by work ahead, or killed with its process."""
    assert both_ready(pool)
    clock_s = 0.0
    monkeypatch.setattr("app.compute.pool.time", SimpleNamespace(monotonic=lambda: clock_s))
    monkeypatch.setattr(pool, "_last_used_s", clock_s)
    likely, asked = Inbox(), Inbox()
    pool.submit(
        "ahead", jobs.report_and_note, str(tmp_path), "ahead", key="same", ahead=True, **likely.callbacks()
    )
    wait_for(tmp_path / "ahead")
    ticket = pool.submit("person", jobs.count, 1, key="same", **asked.callbacks())
    clock_s = 7.0
    pool.stop(ticket)
    assert asked.end() == Outcome("stopped")
    assert pool.idle_s() == 0.0
    pool.submit("person", jobs.count, 1, key="same", **asked.callbacks())
    clock_s = 9.0
    (tmp_path / "go").touch()
    assert asked.end() == Outcome("result", "ahead")
    assert pool.idle_s() == 0.0
    clock_s = 12.0
    pool.submit("person", jobs.crash, **asked.callbacks())
    assert asked.end() == Outcome("error", DIED)
    assert pool.idle_s() == 0.0


def test_work_ahead_leaves_a_process_free_and_waits_while_anything_is_asked_for(pool, tmp_path):
    assert both_ready(pool)
    asked, likely = Inbox(), [Inbox(), Inbox()]
    pool.submit("person", jobs.note, str(tmp_path), "asked", **asked.callbacks())
    wait_for(tmp_path / "asked")
    for number, inbox in enumerate(likely):
        pool.submit(
            f"ahead {number}", jobs.note, str(tmp_path), f"likely{number}", ahead=True, **inbox.callbacks()
        )
    threading.Event().wait(0.3)
    assert not list(tmp_path.glob("likely*"))
    assert pool.idle_s() == 0.0
    tickets = [ticket for ticket in pool._waiting if ticket.ahead]
    pool.stop(tickets[0])
    assert likely[0].end().kind == "stopped"
    (tmp_path / "go").touch()
    assert asked.end() == Outcome("result", "asked")
    assert likely[1].end() == Outcome("result", "likely1")


class Pool:
    """Runs work ahead as it is told to: by running the job, or by stopping it."""

    def __init__(self, store, idle_s=10.0):
        self.store, self.idle, self.stops, self.asked = store, idle_s, 0, []

    def idle_s(self):
        return self.idle

    def submit(self, owner, function, *arguments, on_progress, on_end, key, ahead):
        assert ahead
        self.asked.append(key)
        if self.stops:
            self.stops -= 1
            on_end(Outcome("stopped"))
        else:
            function(*arguments)
            on_end(Outcome("result"))


@pytest.fixture
def own(tmp_path, monkeypatch):
    monkeypatch.setattr(ahead, "LOOK_S", 0.01)
    monkeypatch.setattr(ahead.psutil, "sensors_battery", lambda: None, raising=False)
    return Store(str(tmp_path))


def likely_jobs(store, names):
    return lambda: [LikelyJob(name, store.put, (kept(name), name)) for name in names]


def test_likely_jobs_are_computed_in_order_what_is_there_is_not_and_then_it_ends(own):
    pool = Pool(own)
    work = WorkAhead(pool, own)
    assert not work.done
    own.put(kept("b"), "there")
    work.plan("scene", likely_jobs(own, "abc"))
    assert happens(lambda: work.done)
    assert pool.asked == ["a", "c"]
    work.plan("scene", likely_jobs(own, "xyz"))  # every session that shows the scene says so
    assert work.done
    work.plan("another scene", likely_jobs(own, "d"))
    assert happens(lambda: work.done)
    assert pool.asked == ["a", "c", "d"]


def test_what_is_stopped_is_begun_again(own):
    pool = Pool(own)
    pool.stops = 2
    work = WorkAhead(pool, own)
    work.plan("scene", likely_jobs(own, "abc"))
    assert happens(lambda: work.done)
    assert pool.asked == ["a", "a", "a", "b", "c"]


@pytest.mark.parametrize("why", ["people ask", "on its battery"])
def test_nothing_begins_while_people_ask_or_on_a_battery(own, monkeypatch, why):
    pool = Pool(own)
    if why == "people ask":
        pool.idle = 0.0
    else:
        battery = SimpleNamespace(power_plugged=False)
        monkeypatch.setattr(ahead.psutil, "sensors_battery", lambda: battery, raising=False)
    work = WorkAhead(pool, own)
    work.plan("scene", likely_jobs(own, "a"))
    threading.Event().wait(0.2)
    assert pool.asked == []
    assert not work.done
    work.close()
    assert happens(lambda: not work._thread.is_alive())
    work.plan("later", likely_jobs(own, "b"))
    assert pool.asked == []


def test_a_pool_that_is_closed_ends_it(own):
    class Closed(Pool):
        def submit(self, *_, **__):
            raise RuntimeError("the pool is closed")

    work = WorkAhead(Closed(own), own)
    work.plan("scene", likely_jobs(own, "ab"))
    assert happens(lambda: not work._thread.is_alive())
