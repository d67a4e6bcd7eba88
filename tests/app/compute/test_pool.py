"""The pool of computing processes and its latest-wins lanes."""

import functools
import multiprocessing
import queue
import subprocess
import sys
import threading
from pathlib import Path

import psutil
import pytest

sys.path.insert(0, str(Path(__file__).parent))
import pool_jobs as jobs

from app.compute.lane import LatestWins, UrgentLanes
from app.compute.pool import DIED, ComputePool, Outcome

TIMEOUT_S = 60.0


@pytest.fixture(scope="module")
def pool():
    pool = ComputePool(size=2, patience_s=0.3)
    yield pool
    pool.close()


class Inbox:
    """Collects what a job says and waits for its end."""

    def __init__(self) -> None:
        self.progress: list = []
        self.ends: queue.Queue[Outcome] = queue.Queue()

    def callbacks(self) -> dict:
        return {"on_progress": self.progress.append, "on_end": self.ends.put}

    def end(self) -> Outcome:
        return self.ends.get(timeout=TIMEOUT_S)


def wait_for(path: Path) -> None:
    tick = threading.Event()
    for _ in range(int(TIMEOUT_S / 0.01)):
        if path.exists():
            return
        tick.wait(0.01)
    raise TimeoutError(path)


def test_progress_arrives_in_order_before_the_result(pool):
    inbox = Inbox()
    pool.submit("a", jobs.count, 5, **inbox.callbacks())
    assert inbox.end() == Outcome("result", 5)
    assert [report.fraction for report in inbox.progress] == [0.0, 0.2, 0.4, 0.6, 0.8]


def test_of_a_burst_only_the_first_and_the_last_run(pool, tmp_path):
    lane, inbox = LatestWins(pool, "burst"), Inbox()
    for i in range(15):
        lane.submit(jobs.note, str(tmp_path), f"job{i}", **inbox.callbacks())
        if i == 0:
            wait_for(tmp_path / "job0")
    (tmp_path / "go").touch()
    values = [inbox.end().value, inbox.end().value]
    assert values[-1] == "job14"
    assert {path.name for path in tmp_path.glob("job*")} == {"job0", "job14"}
    assert inbox.ends.empty()
    assert not lane.busy


def test_a_superseded_job_stops_at_its_next_report(pool, tmp_path):
    lane, first, second = LatestWins(pool, "supersede"), Inbox(), Inbox()
    lane.submit(jobs.count_forever, str(tmp_path), **first.callbacks())
    wait_for(tmp_path / "began")
    lane.submit(jobs.count, 1, **second.callbacks())
    assert first.end().kind == "stopped"
    assert second.end() == Outcome("result", 1)
    assert (tmp_path / "tidied").exists()


def test_a_superseded_job_that_never_reports_loses_its_process(pool, tmp_path):
    lane, first, second = LatestWins(pool, "deaf"), Inbox(), Inbox()
    lane.submit(jobs.deaf, str(tmp_path), **first.callbacks())
    wait_for(tmp_path / "began")
    lane.submit(jobs.count, 1, **second.callbacks())
    assert first.end().kind == "stopped"
    assert second.end() == Outcome("result", 1)


def test_an_urgent_job_does_not_stop_one_of_another_kind(pool, tmp_path):
    lanes, first, second = UrgentLanes(pool), Inbox(), Inbox()
    lanes["look"].submit(jobs.report_and_note, str(tmp_path), "look", **first.callbacks())
    wait_for(tmp_path / "look")
    lanes["measure"].submit(jobs.count, 1, **second.callbacks())
    assert second.end() == Outcome("result", 1)
    (tmp_path / "go").touch()
    assert first.end() == Outcome("result", "look")


def test_the_job_of_a_lane_that_is_stopped_ends_at_its_next_report(pool, tmp_path):
    lane, inbox = LatestWins(pool, "stop"), Inbox()
    lane.submit(jobs.count_forever, str(tmp_path), **inbox.callbacks())
    wait_for(tmp_path / "began")
    lane.stop()
    assert inbox.end().kind == "stopped"
    assert (tmp_path / "tidied").exists()
    assert not lane.busy


def test_a_lane_that_is_stopped_forgets_what_waits(pool, tmp_path):
    lane, first, second = LatestWins(pool, "forget"), Inbox(), Inbox()
    lane.submit(jobs.deaf, str(tmp_path), **first.callbacks())
    wait_for(tmp_path / "began")
    lane.submit(jobs.count, 1, **second.callbacks())
    lane.stop()
    assert first.end().kind == "stopped"
    assert not lane.busy
    assert second.ends.empty()


def test_cancel_ends_the_process_and_the_pool_recovers(pool, tmp_path):
    lane, inbox, after = LatestWins(pool, "cancel"), Inbox(), Inbox()
    lane.submit(jobs.deaf, str(tmp_path), **inbox.callbacks())
    wait_for(tmp_path / "began")
    lane.cancel()
    assert inbox.end().kind == "stopped"
    lane.submit(jobs.count, 2, **after.callbacks())
    assert after.end() == Outcome("result", 2)


@pytest.mark.parametrize(
    ("function", "sentence"),
    [
        (jobs.refuse, "The cloud 'x.ply' is empty; try another file."),
        (jobs.stumble, "This step failed unexpectedly (ZeroDivisionError: division by zero)."),
        (jobs.crash, DIED),
    ],
)
def test_every_failure_is_one_sentence_and_the_pool_goes_on(pool, function, sentence):
    inbox, after = Inbox(), Inbox()
    pool.submit("b", function, **inbox.callbacks())
    assert inbox.end() == Outcome("error", sentence)
    pool.submit("b", jobs.count, 1, **after.callbacks())
    assert after.end() == Outcome("result", 1)


def test_one_owner_never_holds_all_processes(pool, tmp_path):
    greedy = [Inbox(), Inbox(), Inbox()]
    for i, inbox in enumerate(greedy):
        pool.submit("greedy", jobs.note, str(tmp_path), f"greedy{i}", **inbox.callbacks())
    wait_for(tmp_path / "greedy0")
    other = Inbox()
    pool.submit("other", jobs.count, 1, **other.callbacks())
    assert other.end() == Outcome("result", 1)
    assert not (tmp_path / "greedy1").exists()
    (tmp_path / "go").touch()
    assert [inbox.end().value for inbox in greedy] == ["greedy0", "greedy1", "greedy2"]


def test_what_several_ask_for_is_computed_once(pool, tmp_path):
    inboxes = [Inbox() for _ in range(5)]
    for i, inbox in enumerate(inboxes):
        pool.submit(
            f"one of {i}", jobs.report_and_note, str(tmp_path), f"run{i}", key="same", **inbox.callbacks()
        )
        if i == 0:
            wait_for(tmp_path / "run0")
    (tmp_path / "go").touch()
    assert [inbox.end() for inbox in inboxes] == [Outcome("result", "run0")] * 5
    assert [path.name for path in tmp_path.glob("run*")] == ["run0"]
    assert all(len(inbox.progress) >= 1 for inbox in inboxes[1:])


def test_who_waits_for_what_another_has_running_begins_nothing_beside_it(pool, tmp_path):
    first, shared, own = Inbox(), Inbox(), Inbox()
    pool.submit("first", jobs.note, str(tmp_path), "first", key="both want it", **first.callbacks())
    wait_for(tmp_path / "first")
    pool.submit("waits", jobs.count, 1, key="both want it", **shared.callbacks())
    pool.submit("waits", jobs.count, 2, **own.callbacks())
    other = Inbox()
    pool.submit("other", jobs.count, 3, **other.callbacks())
    assert other.end() == Outcome("result", 3)  # a process was free
    assert not own.progress
    (tmp_path / "go").touch()
    assert [inbox.end().value for inbox in (first, shared, own)] == ["first", "first", 2]


def test_who_waits_for_a_job_that_is_stopped_has_it_computed(pool, tmp_path):
    first, second = Inbox(), Inbox()
    ticket = pool.submit("leaves", jobs.note, str(tmp_path), "left", key="shared", **first.callbacks())
    wait_for(tmp_path / "left")
    pool.submit("stays", jobs.count, 1, key="shared", **second.callbacks())
    pool.stop(ticket)
    assert first.end().kind == "stopped"
    assert second.end() == Outcome("result", 1)


def test_who_waits_for_a_job_whose_process_dies_gets_the_same_sentence(pool, tmp_path):
    inboxes = [Inbox(), Inbox()]
    for i, inbox in enumerate(inboxes):
        pool.submit(f"unlucky {i}", jobs.crash_when_told, str(tmp_path), key="deadly", **inbox.callbacks())
    wait_for(tmp_path / "began")
    (tmp_path / "go").touch()
    assert [inbox.end() for inbox in inboxes] == [Outcome("error", DIED)] * 2


def test_what_is_urgent_goes_before_all_that_waits(tmp_path):
    pool, running, order = ComputePool(size=1), Inbox(), queue.Queue()
    try:
        pool.submit("busy", jobs.note, str(tmp_path), "busy", **running.callbacks())
        wait_for(tmp_path / "busy")
        for name, urgent in (("first", False), ("second", False), ("urgent", True)):
            ended = functools.partial(lambda name, _: order.put(name), name)
            pool.submit(name, jobs.count, 0, urgent=urgent, on_progress=print, on_end=ended)
        (tmp_path / "go").touch()
        assert [order.get(timeout=TIMEOUT_S) for _ in range(3)] == ["urgent", "first", "second"]
    finally:
        pool.close()


def test_a_process_warms_up_while_no_job_waits():
    pool = ComputePool(size=1, warm_up=jobs.warm_up_without_end)
    try:
        counts = []
        for _ in range(2):
            inbox = Inbox()
            pool.submit("a", jobs.warmed, **inbox.callbacks())
            count, first = inbox.end().value
            assert first == "before the first job"
            counts.append(count)
            threading.Event().wait(0.3)
        assert counts[0] < counts[1]
    finally:
        pool.close()


@pytest.mark.parametrize("first_dies", [False, True])
def test_processes_start_one_after_the_other_even_if_one_dies(first_dies, monkeypatch, tmp_path):
    """The second would take a core from the imports of the first, whose job is waited for."""
    monkeypatch.setenv("STARTED", str(tmp_path))
    pool, inboxes = ComputePool(size=2, warm_up=jobs.warm_up_when_told), (Inbox(), Inbox())
    try:
        for owner, inbox in zip("ab", inboxes, strict=True):
            pool.submit(owner, jobs.count, 1, **inbox.callbacks())
        wait_for(tmp_path / "1")
        threading.Event().wait(0.5)
        (first,) = tmp_path.iterdir()
        if first_dies:
            psutil.Process(int(first.read_text())).kill()
            wait_for(tmp_path / "2")
        (tmp_path / "go").touch()
        assert [inbox.end() for inbox in inboxes] == 2 * [Outcome("result", 1)]
        wait_for(tmp_path / "2")
    finally:
        pool.close()


def test_a_warm_up_that_fails_leaves_a_process_that_works():
    pool, ids = ComputePool(size=1, warm_up=jobs.warm_up_that_fails), []
    try:
        for _ in range(2):
            inbox = Inbox()
            pool.submit("a", jobs.process_id, **inbox.callbacks())
            ids.append(inbox.end().value)
            threading.Event().wait(0.3)  # it goes on to warm up, and fails
        assert ids[0] == ids[1]
    finally:
        pool.close()


def test_computing_processes_import_nothing_slow_that_they_do_not_need():
    slow = ("viser", "dash", "scipy.stats", "torch", "matplotlib", "pandas")
    script = "import sys; from app.compute.jobs import warm_up; list(warm_up()); "
    script += f"print(set({slow}) & set(sys.modules))"
    told = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert told.stdout.strip() == "set()"


def test_a_process_that_cannot_be_started_is_tried_again(monkeypatch):
    failures = [OSError(11, "Resource temporarily unavailable")] * 2
    context = multiprocessing.get_context("spawn").Process

    def start(process):
        if failures:
            raise failures.pop()
        return begin(process)

    begin = context.start
    monkeypatch.setattr(context, "start", start)
    pool, inbox = ComputePool(size=1), Inbox()
    try:
        pool.submit("a", jobs.count, 1, **inbox.callbacks())
        assert inbox.end() == Outcome("result", 1)
        assert not failures
    finally:
        pool.close()


def test_close_leaves_no_process_behind():
    pool, inbox = ComputePool(size=1), Inbox()
    pool.submit("a", jobs.process_id, **inbox.callbacks())
    pid = inbox.end().value
    pool.close()
    assert not psutil.pid_exists(pid) or psutil.Process(pid).status() == psutil.STATUS_ZOMBIE
