"""Tasks on this machine's cores or on a cluster: each is done once, and only a few are handed out ahead."""

import math
import multiprocessing.connection
import os
import signal
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path

import pytest

from packetmesh.batch import process_pool, run_batch
from packetmesh.errors import InputError, PacketMeshError

PROCESS = "__import__('os').getpid()"
KILLED = "__import__('os').kill(__import__('os').getpid(), 9)"
INTERRUPTED = """
from packetmesh.batch import run_batch

if __name__ == "__main__":
    list(run_batch(eval, ["print(end='.', flush=True) or __import__('time').sleep(600)"] * 5, processes=2))
"""


def test_every_task_is_done_once():
    answers = list(run_batch(abs, range(-20, 0), processes=2))
    assert sorted(answers) == [(index, 20 - index) for index in range(20)]


def test_no_task_gives_nothing():
    assert list(run_batch(abs, [])) == []
    assert list(run_batch(abs, [], killed=killed)) == []


@pytest.mark.parametrize(("tasks", "processes"), [(1, None), (3, 1)])
def test_a_single_task_or_process_stays_in_this_process(tasks, processes):
    assert list(run_batch(eval, [PROCESS] * tasks, processes=processes)) == [
        (index, os.getpid()) for index in range(tasks)
    ]


def test_several_tasks_go_to_as_many_other_processes_as_are_allowed():
    workers = set(dict(run_batch(eval, [PROCESS] * 12, processes=2)).values())
    assert os.getpid() not in workers
    assert 1 <= len(workers) <= 2


def test_processes_share_the_cores_unless_the_environment_says_otherwise(monkeypatch):
    asked = "__import__('os').environ['OMP_NUM_THREADS']"
    monkeypatch.delenv("OMP_NUM_THREADS", raising=False)
    share = str(max(1, (os.cpu_count() or 1) // 2))
    assert set(dict(run_batch(eval, [asked] * 4, processes=2)).values()) == {share}
    monkeypatch.setenv("OMP_NUM_THREADS", "7")
    assert set(dict(run_batch(eval, [asked] * 4, processes=2)).values()) == {"7"}


def test_a_new_process_begins_with_what_it_is_given():
    with process_pool(1, os.putenv, "PACKETMESH_TOLD", "yes") as pool:
        assert (
            pool.submit(eval, "__import__('subprocess').getoutput('echo $PACKETMESH_TOLD')").result() == "yes"
        )


def test_answers_come_in_the_order_of_completion(tmp_path):
    """The first task ends only after the answer to the second was seen."""
    seen = tmp_path / "seen"
    exists = f"__import__('os').path.exists({str(seen)!r})"
    wait_until_seen = f"[__import__('time').sleep(0.01) for _ in iter(lambda: {exists}, True)]"
    order = []
    for index, _ in run_batch(eval, [wait_until_seen, "0"], processes=2):
        order.append(index)
        seen.touch()
    assert order == [1, 0]


def test_an_error_of_a_task_is_the_batch_s():
    with pytest.raises(ValueError, match="math domain error"):
        list(run_batch(math.sqrt, [1.0, -1.0], processes=2))


def test_a_killed_process_is_one_sentence():
    with pytest.raises(PacketMeshError, match="One of 2 processes ended unexpectedly"):
        list(run_batch(eval, [KILLED] * 2, processes=2))


def killed(task):
    return "killed"


def test_a_killed_process_fails_only_the_task_that_killed_it():
    tasks = [KILLED if index in (1, 5) else str(index) for index in range(9)]
    answers = dict(run_batch(eval, tasks, processes=2, killed=killed))
    assert answers == {index: "killed" if index in (1, 5) else index for index in range(9)}


def test_a_killed_process_spares_the_caller_of_a_single_task():
    assert list(run_batch(eval, [KILLED], killed=killed)) == [(0, "killed")]


def test_a_process_that_starts_when_another_is_killed_ends_with_it(monkeypatch, tmp_path):
    """Starting the second, once the first has its task, takes until that has killed it."""
    began, go = tmp_path / "began", tmp_path / "go"
    told = f"lambda: __import__('os').path.exists({str(go)!r})"
    task = f"[open({str(began)!r}, 'w'), *iter({told}, True), {KILLED}]"
    started = []
    start = multiprocessing.context.SpawnProcess.start

    def start_slowly(process):
        while started and not began.exists():
            time.sleep(0.01)
        start(process)
        started.append(process)
        for first in started[:-1]:
            go.touch()
            multiprocessing.connection.wait([first.sentinel])
            time.sleep(0.5)

    monkeypatch.setattr(multiprocessing.context.SpawnProcess, "start", start_slowly)
    with pytest.raises(PacketMeshError, match="ended unexpectedly"):
        list(run_batch(eval, [task] + [PROCESS] * 3, processes=2))
    assert len(started) == 2
    for process in started:
        assert process.exitcode is not None


def test_stopping_early_drops_what_has_not_begun(tmp_path):
    """Of fifty tasks that leave a file each, those that were not handed out leave none."""
    answers = run_batch(os.mkdir, [str(tmp_path / str(index)) for index in range(50)], processes=2)
    next(answers)
    answers.close()
    assert 1 <= len(list(tmp_path.iterdir())) <= 5


def heed_interrupts():
    """A shell starts what runs in its background with interrupts ignored, and that is inherited."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)


@pytest.mark.skipif(sys.platform == "win32", reason="process groups are POSIX")
def test_an_interrupt_from_the_terminal_ends_tasks_that_run(tmp_path):
    script = tmp_path / "interrupted.py"
    script.write_text(INTERRUPTED)
    process = subprocess.Popen(
        [sys.executable, str(script)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
        preexec_fn=heed_interrupts,
        env=os.environ | {"PYTHONPATH": str(Path(__file__).parents[2])},
    )
    try:
        assert process.stdout is not None
        assert process.stdout.read(2) == ".."  # both processes have begun a task
        os.killpg(process.pid, signal.SIGINT)
        # The pipes close when the last process of the group has ended: none of them sleeps its ten minutes.
        _, errors = process.communicate(timeout=60)
    finally:
        with suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)
    assert process.returncode == -signal.SIGINT
    assert errors.count("Traceback") == 1
    assert errors.rstrip().endswith("KeyboardInterrupt")


def test_a_scheduler_that_is_not_there_is_one_sentence():
    pytest.importorskip("distributed", reason="needs the package distributed")
    with pytest.raises(InputError, match="no Dask scheduler at nowhere://1"):
        list(run_batch(abs, [1], "nowhere://1"))


def test_a_cluster_without_the_package_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(InputError, match="packetmesh\\[cluster\\]"):
        list(run_batch(abs, [1], "tcp://127.0.0.1:9"))


def test_a_cluster_does_every_task_once_and_an_error_of_one_is_the_batch_s():
    distributed = pytest.importorskip("distributed", reason="needs the package distributed")
    with distributed.LocalCluster(n_workers=1, threads_per_worker=2, dashboard_address=None) as cluster:
        address = cluster.scheduler_address
        assert sorted(run_batch(abs, range(-20, 0), address)) == [(index, 20 - index) for index in range(20)]
        with pytest.raises(ValueError, match="math domain error"):
            list(run_batch(math.sqrt, [-1.0], address))
