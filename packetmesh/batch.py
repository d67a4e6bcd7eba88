"""Many independent tasks: on this machine's cores, or on a Dask cluster with the same functions."""

from __future__ import annotations

import multiprocessing
import os
import signal
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from typing import Any, TypeVar

from packetmesh.errors import InputError, PacketMeshError

Task = TypeVar("Task")
Answer = TypeVar("Answer")


def run_batch(
    function: Callable[[Task], Answer], tasks: Sequence[Task], scheduler: str | None = None
) -> Iterator[tuple[int, Answer]]:
    """Each task's index and answer, in the order in which they end.

    Args:
        function: importable by its name, as other processes call it.
        tasks: what it is called with, one by one.
        scheduler: address of a Dask scheduler; None takes processes on this machine, one for each core.

    Raises:
        InputError: the scheduler cannot be reached, or ``distributed`` is not installed.
        PacketMeshError: a process was killed.
    """
    if scheduler is not None:
        yield from _on_cluster(function, tasks, scheduler)
        return
    processes = min(len(tasks), os.cpu_count() or 1)
    if processes <= 1:
        yield from ((index, function(task)) for index, task in enumerate(tasks))
        return
    # An interrupt ends this process's loop, and with it the pool; the others only finish what they do.
    with ProcessPoolExecutor(
        processes,
        mp_context=multiprocessing.get_context("spawn"),
        initializer=signal.signal,
        initargs=(signal.SIGINT, signal.SIG_IGN),
    ) as pool:
        futures = {pool.submit(function, task): index for index, task in enumerate(tasks)}
        try:
            for future in as_completed(futures):
                yield futures[future], future.result()
        except BrokenProcessPool:
            raise PacketMeshError(
                "A process of the simulation ended unexpectedly, perhaps out of memory; try fewer nodes, a "
                "shorter run.horizon_s or run.keep=counters"
            ) from None
        finally:
            pool.shutdown(wait=False, cancel_futures=True)


def _on_cluster(
    function: Callable[[Any], Any], tasks: Sequence[Any], scheduler: str
) -> Iterator[tuple[int, Any]]:
    try:
        from distributed import Client
        from distributed import as_completed as ended
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
        futures = {
            future: index for index, future in enumerate(client.map(function, list(tasks), pure=False))
        }
        for future in ended(list(futures), loop=client.loop):
            yield futures[future], future.result()
