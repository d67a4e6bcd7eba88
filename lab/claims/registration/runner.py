"""Runs a benchmark's tasks in processes and stores each result as it comes."""

from __future__ import annotations

import multiprocessing
import signal
from collections.abc import Generator
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from dataclasses import asdict
from pathlib import Path
from typing import Any

from lab.claims.registration.capture import capture_range
from lab.claims.registration.cases import CONDITIONS, make_case
from lab.claims.registration.setup import CURVED, Setup
from lab.claims.registration.store import Store, Task
from lab.claims.registration.trials import run_task
from packetmesh.errors import PacketMeshError
from packetmesh.progress import Progress

WORKERS = 2
CAPTURE = "capture"
"""Name of the tasks that map capture ranges."""
CAPTURE_CONDITION = "easy"


def run_trials(
    setup: Setup, folder: Path, workers: int = WORKERS
) -> Generator[Progress, None, dict[Task, dict[str, Any]]]:
    """Do what ``folder`` does not have yet; stopping the generator cancels what has not begun.

    Args:
        setup: the benchmark.
        folder: keeps the results, in a file named by the set-up's key.
        workers: processes.

    Returns:
        The results of every task of the set-up, in the set-up's order whatever the order they came in.
    """
    store = Store(folder, setup.key())
    tasks = [(name, room) for room in setup.rooms for name in setup.lineups]
    tasks += [(CAPTURE, room) for room in setup.capture_rooms]
    waiting = [task for task in tasks if task not in store.results]
    done = len(tasks) - len(waiting)
    yield Progress(f"registration trials: {done} of {len(tasks)} at hand", done / max(len(tasks), 1))
    if waiting:
        for task, result in _computed(setup, waiting, workers):
            store.add(task, result)
            done += 1
            yield Progress(f"registration trials: {task[0]}, room {task[1]}", done / len(tasks))
    return {task: store.results[task] for task in tasks}


def _computed(
    setup: Setup, waiting: list[Task], workers: int
) -> Generator[tuple[Task, dict[str, Any]], None, None]:
    """Results as they come; only a few tasks ahead are handed out, so that stopping is quick."""
    # An interrupt ends this process's loop, and with it the pool; the workers only finish what they do.
    pool = ProcessPoolExecutor(
        workers,
        mp_context=multiprocessing.get_context("spawn"),
        initializer=signal.signal,
        initargs=(signal.SIGINT, signal.SIG_IGN),
    )
    running: dict[Future[dict[str, Any]], Task] = {}
    remaining = iter(waiting)
    try:
        while True:
            while len(running) < 2 * workers and (task := next(remaining, None)) is not None:
                running[pool.submit(compute, setup, task)] = task
            if not running:
                return
            for finished in wait(running, return_when=FIRST_COMPLETED).done:
                yield running.pop(finished), finished.result()
    except BrokenProcessPool:
        raise PacketMeshError(
            "A process of the benchmark ended unexpectedly, perhaps out of memory; start it again to go on "
            "where it stopped, with fewer workers."
        ) from None
    finally:
        pool.shutdown(wait=True, cancel_futures=True)


def compute(setup: Setup, task: Task) -> dict[str, Any]:
    """The plain result of one task; its times are apart from what repeats bit for bit."""
    name, room = task
    if name == CAPTURE:
        return _capture(setup, room)
    condition = CONDITIONS[name]
    trials, timings = run_task(
        make_case(condition, room),
        condition,
        room,
        setup.lineups[name],
        setup.max_points,
        CURVED if name in setup.curves else (),
    )
    return {"trials": [asdict(t) for t in trials], "timings": [asdict(t) for t in timings]}


def _capture(setup: Setup, room: int) -> dict[str, Any]:
    condition = CONDITIONS[CAPTURE_CONDITION]
    case = make_case(condition, room).thinned(setup.max_points)
    cells = []
    for entrant, told in setup.captured:
        config = entrant.config("q2p", condition.gate_m, setup.max_points)
        found = capture_range(
            case.source,
            case.target,
            case.T_true,
            config,
            seed=room,
            method=entrant.start(),
            gate_by_start=told,
        )
        cells += [asdict(cell) | {"entrant": entrant.name, "home": cell.home} for cell in found]
    return {"cells": cells}
