"""What a running app survives: killed processes, a full disk, a killed server, a clock that is set back."""

import ast
import contextlib
import errno
import os
import resource
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import psutil
import pytest
import viser

sys.path.insert(0, str(Path(__file__).parent))
import pool_jobs

import app.server
from app.compute.pool import DIED
from app.load.connection import Connection, wait_for
from app.screens.calibrate.uploads import keep_photographs
from app.server import build_server
from app.session.session import Session
from app.web.own_folder import LOCK, PREFIX, delete_abandoned, own_folder
from app.web.uploads import keep_upload
from app.window.stepper import MARKS
from packetmesh.errors import InputError
from tests.paths import ROOT

pytestmark = pytest.mark.xdist_group("faults")  # one worker starts the server once
LONG_S = 240.0
"""On a machine that does much else."""


@pytest.fixture(scope="module")
def running():
    """An app with all that it can compute of a small room."""
    server = build_server("box-on-table", port=0)
    yield server
    server.stop()


@pytest.fixture
def page(running):
    with contextlib.closing(Connection(running.url)) as one:
        wait_for(lambda: "Radius (mm)" in one.uuids and bool(one.steps), LONG_S)
        yield one


def up_to_date(page):
    return page.mark("Surface") == MARKS["fresh"]


def kill_worker_of(running, what):
    """SIGKILL the computing process that has a job, as soon as one has it."""

    def killed():
        for slot in running.pool._slots:
            ticket = slot.ticket
            if ticket is not None and ticket.arguments[0] == what:
                os.kill(slot.process.pid, signal.SIGKILL)
                return True
        return False

    end_s = time.monotonic() + LONG_S
    while not killed():
        assert time.monotonic() < end_s
        time.sleep(0.001)


def test_a_worker_killed_at_any_stage_is_one_sentence_and_the_stage_can_be_asked_for_again(running, page):
    for step in ("scene", "depth", "fuse", "surface"):
        kill_worker_of(running, step)
        wait_for(lambda step=step: f"{step.capitalize()} failed: {DIED}" in page.notices, LONG_S)
        assert page.reads(f"**Stopped** · {DIED}")
        page.set("All steps", "Retry")
    wait_for(lambda: up_to_date(page), LONG_S)
    assert len(page.notices) == len({*page.notices})
    assert not page.lost


def test_a_worker_killed_beside_the_chain_costs_only_that_answer(running, page):
    wait_for(lambda: up_to_date(page), LONG_S)
    page.go("Export")
    wait_for(lambda: page.current == "Export")
    page.set("Numbers", "Run folder")
    kill_worker_of(running, "export.job:export_job")
    wait_for(lambda: f"That did not work: {DIED}" in page.notices, LONG_S)
    page.go("Depth")
    wait_for(lambda: page.current == "Depth")
    assert up_to_date(page)


def test_no_job_of_a_browser_that_left_runs_on(running, tmp_path):
    """Not one that reports, and not one that never does."""
    with contextlib.closing(Connection(running.url)) as one:
        wait_for(lambda: bool(one.steps) and up_to_date(one) and len(running.sessions) == 1, LONG_S)
        (session,) = running.sessions.values()
        for lane, job in ((session._side, pool_jobs.count_forever), (session._quick["deaf"], pool_jobs.deaf)):
            (tmp_path / job.__name__).mkdir()
            lane.submit(job, str(tmp_path / job.__name__), on_progress=repr, on_end=repr)
        wait_for(lambda: len(list(tmp_path.glob("*/began"))) == 2, LONG_S)
    wait_for(lambda: not running.sessions and not running.pool.running(), LONG_S)
    assert (tmp_path / "count_forever" / "tidied").exists()
    assert not list(running.folder.path.glob("upload-*"))


def test_a_browser_that_leaves_before_its_session_is_there_leaves_none(running, monkeypatch):
    building, gone, begun = threading.Event(), threading.Event(), []

    def late(*arguments):
        building.set()
        assert gone.wait(LONG_S)
        begun.append(Session(*arguments))
        return begun[0]

    monkeypatch.setattr(app.server, "Session", late)
    with contextlib.closing(Connection(running.url)):
        wait_for(building.is_set)
    wait_for(lambda: not running.viser_server.get_clients())
    gone.set()
    wait_for(lambda: bool(begun) and begun[0]._closed)
    assert not running.sessions


def test_a_disk_without_room_for_another_session_is_one_sentence_and_others_go_on(running, page, monkeypatch):
    def full(*arguments):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(app.server, "Session", full)
    with contextlib.closing(Connection(running.url)) as other:
        wait_for(lambda: bool(other.notices))
        assert other.notices == [
            "The app cannot start for you: A file cannot be used (No space left on device); "
            "delete something there, as the disk is full"
        ]
    other_step = "Fuse" if page.current != "Fuse" else "Depth"
    page.go(other_step)
    wait_for(lambda: page.current == other_step)


UPLOADS = {
    "pair": lambda file, folder: keep_upload(file, folder, 1 << 20, "use the command line"),
    "photographs": lambda file, folder: keep_photographs(file, folder, "node_00"),
}


@pytest.mark.parametrize("keep", UPLOADS)
def test_an_upload_for_which_the_disk_has_no_room_is_one_sentence_and_leaves_no_part(tmp_path, keep):
    file = viser.UploadedFile("color.png", bytes(50_000))
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (1_000, hard))
    try:
        with pytest.raises(InputError, match=r"cannot be written \(File too large\); delete something there"):
            UPLOADS[keep](file, tmp_path)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert [path for path in tmp_path.rglob("*") if path.is_file()] == []


def test_with_the_clock_set_back_nothing_waits_for_ever(running, monkeypatch):
    real = time.time
    with contextlib.closing(Connection(running.url)) as one:
        wait_for(lambda: "Radius (mm)" in one.uuids and bool(one.steps), LONG_S)
        monkeypatch.setattr(time, "time", lambda: real() - 86_400.0)
        one.go("Surface")
        wait_for(lambda: one.current == "Surface")
        wait_for(lambda: up_to_date(one), LONG_S)
        changed_s = time.monotonic()
        one.set("Radius (mm)", 31.5)
        wait_for(lambda: up_to_date(one) and one.shown_s["surface"] > changed_s, LONG_S)


def test_nothing_is_measured_by_the_clock_on_the_wall():
    wall = {"time.time", "datetime.now", "datetime.datetime.now", "datetime.utcnow", "time.localtime"}
    for package in ("packetmesh", "network_sim", "pipeline", "lab", "app"):
        for file in (ROOT / package).rglob("*.py"):
            calls = (node for node in ast.walk(ast.parse(file.read_bytes())) if isinstance(node, ast.Call))
            assert not wall & {ast.unparse(call.func) for call in calls}, file


# The server itself.


def serve(folder):
    """A server in a process of its own whose temporary folder is ``folder``, and its address."""
    command = [sys.executable, "-m", "app.cli", "serve", "--scene", "box-on-table", "--port", "0"]
    environment = os.environ | {"TMPDIR": str(folder)}
    process = subprocess.Popen(command, env=environment, stderr=subprocess.PIPE, text=True, cwd=ROOT)
    line = process.stderr.readline()
    assert "http://" in line, line
    return process, next(word for word in line.split() if word.startswith("http://"))


def stored(folder):
    return [path for path in folder.glob(f"{PREFIX}*/*") if path.is_file() and path.name != LOCK]


def test_a_server_killed_while_it_writes_leaves_no_process_and_the_next_one_deletes_its_files(tmp_path):
    process, url = serve(tmp_path)
    try:
        with contextlib.closing(Connection(url)):
            wait_for(lambda: bool(stored(tmp_path)), LONG_S)
            workers = psutil.Process(process.pid).children(recursive=True)
            process.kill()
        process.wait()
    finally:
        process.kill()
    assert psutil.wait_procs(workers, timeout=LONG_S)[1] == []
    (abandoned,) = tmp_path.glob(f"{PREFIX}*")
    assert stored(tmp_path)
    process, url = serve(tmp_path)
    try:
        with contextlib.closing(Connection(url)) as page:
            wait_for(lambda: bool(page.steps) and page.mark("Scene") == MARKS["fresh"], LONG_S)
        assert not abandoned.exists()
    finally:
        process.terminate()
        process.wait()
    assert list(tmp_path.glob(f"{PREFIX}*")) == []


def test_only_what_nobody_uses_is_deleted(tmp_path, monkeypatch):
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    used, left = own_folder(), own_folder()
    left.lock.close()
    (tmp_path / f"{PREFIX}of-somebody").mkdir()
    delete_abandoned()
    assert {path.name for path in tmp_path.iterdir()} == {used.path.name, f"{PREFIX}of-somebody"}
    used.delete()
    assert not used.path.exists()
