"""The door to the jobs: the serving process names them here and never imports what they need."""

from __future__ import annotations

import importlib
from typing import Any

JOBS = {
    "scene": "app.screens.scene.job:scene_job",
    "depth": "app.screens.depth.job:depth_job",
    "hide": "app.screens.depth.hide_job:hide_job",
    "model": "app.screens.depth.model_job:model_job",
    "fuse": "app.screens.fuse.job:fuse_job",
    "surface": "app.screens.surface.job:surface_job",
    "paint": "app.screens.surface.paint_job:paint_job",
    "sweep": "app.screens.surface.sweep_job:sweep_job",
    "walk": "app.screens.surface.walk_job:walk_job",
    "explain": "app.screens.surface.holes_job:explain_job",
    "fill": "app.screens.surface.holes_job:fill_job",
    "baseline": "app.screens.surface.baselines_job:baseline_job",
    "race": "app.screens.fuse.race_job:race_job",
    "capture": "app.screens.fuse.capture_job:capture_job",
    "network": "app.screens.network.job:network_job",
    "export": "app.screens.export.job:export_job",
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
