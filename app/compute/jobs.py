"""The door to the computing processes: the serving process names jobs and never imports what they need.

A job is a function in a module of a screen whose name ends in ``job``, and its address is what stands
behind ``app.screens.``: ``fuse.race_job:race_job``. The job of a step is ``STEP.job:STEP_job``.
"""

from __future__ import annotations

import importlib
import os
import pkgutil
from collections.abc import Iterator
from typing import Any

from app.compute.pool import ComputePool
from app.compute.state import CHAIN

SCREENS = "app.screens"


def run(job: str, *arguments: Any) -> Any:
    """Start a job by its address, in a computing process."""
    module, _, function = job.partition(":")
    return getattr(importlib.import_module(f"{SCREENS}.{module}"), function)(*arguments)


def run_step(step: str, *arguments: Any) -> Any:
    """Start the job of a step."""
    return run(f"{step}.job:{step}_job", *arguments)


def start_pool() -> ComputePool:
    """Computing processes that know every job; the first begins at once."""
    return ComputePool(size=max(2, (os.cpu_count() or 1) // 2), warm_up=warm_up)


def warm_up() -> Iterator[None]:
    """Import the first step's job, then all others and what is compiled, a little before each yield."""
    for step in CHAIN:
        importlib.import_module(f"{SCREENS}.{step}.job")
        yield
    screens = importlib.import_module(SCREENS)
    for screen in pkgutil.iter_modules(screens.__path__, f"{SCREENS}."):
        for module in pkgutil.iter_modules(importlib.import_module(screen.name).__path__, f"{screen.name}."):
            if module.name.endswith("job"):
                importlib.import_module(module.name)
                yield
    yield from importlib.import_module("app.compute.warm").warm_up()
