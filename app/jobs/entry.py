"""The door to the jobs: the serving process names them here and never imports what they need."""

from __future__ import annotations

import importlib
from typing import Any

JOBS = {
    "scene": "app.jobs.views:scene_job",
    "depth": "app.jobs.depth:depth_job",
    "hide": "app.jobs.depth_hide:hide_job",
    "network": "app.jobs.depth_network:network_job",
    "fuse": "app.jobs.views:fuse_job",
    "surface": "app.jobs.views:surface_job",
    "paint": "app.jobs.paint:paint_job",
    "sweep": "app.jobs.sweep:sweep_job",
    "walk": "app.jobs.walk:walk_job",
    "explain": "app.jobs.holes:explain_job",
    "fill": "app.jobs.holes:fill_job",
    "yardstick": "app.jobs.yardsticks:yardstick_job",
    "race": "app.jobs.race:race_job",
    "capture": "app.jobs.capture:capture_job",
    "simulate": "app.jobs.network:simulate_job",
    "export": "app.jobs.export:export_job",
}


def run(job: str, *arguments: Any) -> Any:
    """Start a job by name, in a computing process."""
    module, _, function = JOBS[job].partition(":")
    return getattr(importlib.import_module(module), function)(*arguments)


def warm_up() -> None:
    """Import everything heavy, and load or compile the ball, before the first job comes."""
    for address in JOBS.values():
        importlib.import_module(address.partition(":")[0])
    importlib.import_module("pipeline.surface.pivoting").compile_all()
