"""Start jobs by name in the computing processes, so that the server never imports what the jobs need.

A job is a function in a module of a screen whose name ends in ``job``. Its address is the module path after
``app.screens.`` and the function: ``fuse.race_job:race_job``. A step's job is ``STEP.job:STEP_job``.
"""

from __future__ import annotations

import importlib
import inspect
import os
import pkgutil
from collections.abc import Generator, Hashable, Iterator
from typing import Any

from app.compute.pool import ComputePool
from app.compute.shared import kept
from app.compute.state import CHAIN, Spec, Step
from app.compute.store import Store

SCREENS = "app.screens"


def run(job: str, *arguments: Any) -> Any:
    """Run the job with this address; called in a computing process."""
    module, _, function = job.partition(":")
    return getattr(importlib.import_module(f"{SCREENS}.{module}"), function)(*arguments)


def run_kept(job: str, key: Hashable, store: Store, spec: Spec, *arguments: Any) -> Generator[Any, None, Any]:
    """Return the answer of the job with this address: from the store, or computed and then stored.

    Args:
        job: address of the job.
        key: everything that the answer depends on.
        store: the server's store.
        spec: passed to the job after the store, before ``arguments``.
    """
    answer = store.get(kept(key))
    if answer is None:
        answer = run(job, store, spec, *arguments)
        if inspect.isgenerator(answer):
            answer = yield from answer
        store.put(kept(key), answer)
    return answer


def run_step(step: Step, store: Store, spec: Spec) -> Generator[Any, None, Any]:
    """Run the job of a step; the answers of the chain's steps are kept in the store."""
    job = f"{step}.job:{step}_job"
    if step in CHAIN:
        return (yield from run_kept(job, spec.key(step), store, spec))
    return (yield from run(job, store, spec))


def start_pool() -> ComputePool:
    """Start and return the pool of computing processes; each of them can run every job."""
    return ComputePool(size=max(2, (os.cpu_count() or 1) // 2), warm_up=warm_up)


def warm_up() -> Iterator[None]:
    """Import the first step's job, then all other jobs, then compile numba functions; yield between them."""
    for step in CHAIN:
        importlib.import_module(f"{SCREENS}.{step}.job")
        yield
    screens = importlib.import_module(SCREENS)
    for module in pkgutil.walk_packages(screens.__path__, f"{SCREENS}."):
        if module.name.endswith("job"):
            importlib.import_module(module.name)
            yield
    yield from importlib.import_module("app.compute.warm").warm_up()
