"""Many independent tasks: on this machine's cores, or on a Dask cluster with the same functions."""

from __future__ import annotations

import multiprocessing
import os
import pickle
import signal
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, CancelledError, Executor, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from typing import Any, TypeVar

from packetmesh.errors import InputError, PacketMeshError

THREAD_LIMITS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS")
"""What libraries read when they are imported."""

Task = TypeVar("Task")
Answer = TypeVar("Answer")


def run_batch(
    function: Callable[[Task], Answer],
    tasks: Sequence[Task],
    scheduler: str | None = None,
    processes: int | None = None,
    killed: Callable[[Task], Answer] | None = None,
) -> Iterator[tuple[int, Answer]]:
    """Each task's index and answer, in the order of completion.

    Only a few tasks are handed out ahead of those that run. Closing the iterator, or an error in a task,
    drops what has not begun and waits for what has; an interrupt from the terminal ends that too.

    Args:
        function: importable by its name, as other processes call it.
        tasks: what it is called with, one by one.
        scheduler: address of a Dask scheduler; None takes processes on this machine.
        processes: how many of them at most, one for each core by default; a single one is this process.
        killed: answers for a task whose process was killed, alone as well as beside others; the other tasks
            go on. Without it that is an error.

    Raises:
        InputError: the scheduler cannot be reached, or ``distributed`` is not installed.
        PacketMeshError: a process was killed, or the cluster was lost.
    """
    if scheduler is not None:
        yield from _on_cluster(function, tasks, scheduler, killed)
        return
    processes = min(len(tasks), processes or os.cpu_count() or 1)
    if processes <= 1:
        yield from ((index, function(task)) for index, task in enumerate(tasks))
        return
    waiting = deque(enumerate(tasks))
    while waiting:
        running: dict[Future[Answer], tuple[int, Task]] = {}
        pool = process_pool(processes)
        try:
            for future in _completed(pool, function, waiting, running, lambda: processes + 1):
                answer = future.result()
                yield running.pop(future)[0], answer
        except BrokenProcessPool:
            if killed is None:
                raise PacketMeshError(
                    f"One of {processes} processes ended unexpectedly, perhaps for lack of memory; "
                    "try fewer processes or smaller tasks"
                ) from None
        finally:
            pool.shutdown(cancel_futures=True)
        for index, task in running.values():
            yield index, _alone(function, task, killed)


def _alone(function: Callable[[Task], Answer], task: Task, killed: Callable[[Task], Answer] | None) -> Answer:
    """The answer of one that ran when a process was killed, in a process of its own."""
    with process_pool(1) as pool:
        try:
            return pool.submit(function, task).result()
        except BrokenProcessPool:
            assert killed is not None
            return killed(task)


def process_pool(processes: int, begin: Callable[..., None] | None = None, *given: Any) -> Executor:
    """New processes that share the cores; libraries whose threads wait for work by spinning get no more, if
    the program's own file does not import them: a new process imports that first.

    They end silently at an interrupt, unless this process ignores interrupts (nohup): then they do, too.

    Args:
        processes: how many.
        begin: importable by its name; called with ``given`` when a process starts.
        given: its arguments.
    """
    heeded = signal.getsignal(signal.SIGINT) is not signal.SIG_IGN
    threads = max(1, (os.cpu_count() or 1) // processes)
    return _Pool(
        processes,
        mp_context=multiprocessing.get_context("spawn"),
        initializer=_begin,
        initargs=(heeded, threads, pickle.dumps((begin, given))),
    )


class _Pool(ProcessPoolExecutor):
    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """When a process is killed while another starts, Python (3.11 to 3.13) does not end the new one, and
        waits for it for ever."""
        if self._broken:
            for process in list((self._processes or {}).values()):
                process.terminate()
        super().shutdown(wait, cancel_futures=cancel_futures)


def _begin(heeded: bool, threads: int, pickled: bytes) -> None:
    """What is pickled imports the libraries that look at the number of threads, so it waits for it."""
    signal.signal(signal.SIGINT, signal.SIG_DFL if heeded else signal.SIG_IGN)
    for name in THREAD_LIMITS:
        os.environ.setdefault(name, str(threads))
    begin, given = pickle.loads(pickled)
    if begin is not None:
        begin(*given)


def _completed(
    pool: Executor,
    function: Callable[[Task], Answer],
    waiting: deque[tuple[int, Task]],
    running: dict[Future[Answer], tuple[int, Task]],
    most: Callable[[], int],
) -> Iterator[Future[Answer]]:
    """What is done, as it comes, while at most ``most()`` tasks are in the pool.

    Args:
        pool: where they run.
        function: what does them.
        waiting: indices and tasks not handed out yet, which are taken from here.
        running: those that are, from which the caller takes each that is done.
        most: how many there may be.
    """
    while True:
        while waiting and len(running) < most():
            future = pool.submit(function, waiting[0][1])
            running[future] = waiting.popleft()
        if not running:
            return
        yield from wait(running, return_when=FIRST_COMPLETED).done


def _on_cluster(
    function: Callable[[Any], Any],
    tasks: Sequence[Any],
    scheduler: str,
    killed: Callable[[Any], Any] | None,
) -> Iterator[tuple[int, Any]]:
    try:
        from distributed import Client, KilledWorker
    except ImportError:
        raise InputError(
            "--scheduler needs the package 'distributed': pip install 'packetmesh[cluster]', or leave it out"
        ) from None
    try:
        client = Client(scheduler, timeout="10s", set_as_default=False)
    except (OSError, ValueError) as error:
        raise InputError(
            f"There is no Dask scheduler at {scheduler} ({error}); start one with 'dask scheduler', "
            "or leave --scheduler out"
        ) from None
    with client:
        pool = client.get_executor(pure=False)
        running: dict[Future[Any], tuple[int, Any]] = {}

        def most() -> int:
            return 2 * sum(client.nthreads().values()) + 1

        try:
            for future in _completed(pool, function, deque(enumerate(tasks)), running, most):
                index, task = running.pop(future)
                try:
                    answer = future.result()
                except KilledWorker:
                    if killed is None:
                        raise
                    answer = killed(task)
                yield index, answer
        except (CancelledError, KilledWorker) as error:
            raise PacketMeshError(
                f"The Dask cluster at {scheduler} was lost ({error}); look whether its scheduler and workers "
                "still run and have enough memory"
            ) from None
        finally:
            pool.shutdown(wait=False)
