"""Parallel execution of independent tasks, on this machine's cores or on a Dask cluster."""

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
"""Environment variables from which libraries read their number of threads when they are imported."""

Task = TypeVar("Task")
Answer = TypeVar("Answer")


def run_batch(
    function: Callable[[Task], Answer],
    tasks: Sequence[Task],
    scheduler: str | None = None,
    processes: int | None = None,
    killed: Callable[[Task], Answer] | None = None,
) -> Iterator[tuple[int, Answer]]:
    """Call ``function`` with each task; yield each task's index and answer in the order of completion.

    At most about twice as many tasks are submitted as can run. When the iterator is closed or a task raises
    an error, waiting tasks are dropped; running ones are completed on this machine and dropped on a cluster.
    Ctrl-C also stops the running tasks.

    Args:
        function: importable by name, because other processes call it.
        tasks: arguments of ``function``, one per call.
        scheduler: address of a Dask scheduler; None uses processes on this machine.
        processes: largest number of processes, by default one per core. With 1, or for a single task, the
            tasks run in this process, unless ``killed`` is given.
        killed: called with a task whose process was killed also when the task ran alone; returns the task's
            answer, and the other tasks continue. None raises an error instead.

    Raises:
        InputError: the scheduler cannot be reached, or ``distributed`` is not installed.
        PacketMeshError: a process was killed and ``killed`` is None, or the cluster was lost.
    """
    if scheduler is not None:
        yield from _on_cluster(function, tasks, scheduler, killed)
        return
    processes = min(len(tasks), processes or os.cpu_count() or 1)
    if processes <= 1 and killed is None:
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
    """Run a task again, alone in a new process; return its answer, or ``killed(task)`` if it is killed."""
    with process_pool(1) as pool:
        try:
            return pool.submit(function, task).result()
        except BrokenProcessPool:
            assert killed is not None
            return killed(task)


def process_pool(processes: int, begin: Callable[..., None] | None = None, *given: Any) -> Executor:
    """Return a pool of new processes that share the cores. Each process limits its libraries' threads to its
    share of the cores, except for libraries that the program's main file imports: it imports that file first.

    At Ctrl-C they exit silently, unless this process ignores interrupts (nohup): then they ignore them too.

    Args:
        processes: number of processes.
        begin: importable by name; each process calls it with ``given`` at its start. None calls nothing.
        given: arguments of ``begin``.
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
        """Terminate all processes of a broken pool, then shut down: when a process is killed while another
        starts, Python (3.11 to 3.13) would wait for the new one for ever."""
        if self._broken:
            for process in list((self._processes or {}).values()):
                process.terminate()
        super().shutdown(wait, cancel_futures=cancel_futures)


def _begin(heeded: bool, threads: int, pickled: bytes) -> None:
    """Set up a new process; unpickling imports libraries that read the thread limits, so it comes last."""
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
    """Yield each future when it is done, while at most ``most()`` tasks are in the pool.

    Args:
        pool: runs the tasks.
        function: called with each task.
        waiting: indices and tasks that are not submitted yet; submitted ones are removed.
        running: submitted tasks by future; the caller removes each one that is done.
        most: returns how many tasks may be in the pool.
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
