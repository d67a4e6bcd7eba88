"""The door to the computing processes: the serving process names jobs and never imports what they need.

A job is a function in a module of a screen whose name ends in ``job``, and its address is what stands
behind ``app.screens.``: ``fuse.race_job:race_job``. The job of a step is ``STEP.job:STEP_job``.
"""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Iterator
from typing import Any

SCREENS = "app.screens"


def run(job: str, *arguments: Any) -> Any:
    """Start a job by its address, in a computing process."""
    module, _, function = job.partition(":")
    return getattr(importlib.import_module(f"{SCREENS}.{module}"), function)(*arguments)


def run_step(step: str, *arguments: Any) -> Any:
    """Start the job of a step."""
    return run(f"{step}.job:{step}_job", *arguments)


def warm_up() -> Iterator[None]:
    """Import every screen's jobs, yield, and go on to load what is compiled, a little at a time."""
    screens = importlib.import_module(SCREENS)
    for screen in pkgutil.iter_modules(screens.__path__, f"{SCREENS}."):
        for module in pkgutil.iter_modules(importlib.import_module(screen.name).__path__, f"{screen.name}."):
            if module.name.endswith("job"):
                importlib.import_module(module.name)
    warm = importlib.import_module("pipeline.warm")
    yield
    yield from warm.warm_up()
