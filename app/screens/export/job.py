"""The job that makes a file for download and returns it as bytes."""

from __future__ import annotations

import json
import tempfile
import zipfile
from collections.abc import Generator
from pathlib import Path
from typing import Any, get_args

from app.compute.records import Shown
from app.compute.state import Spec
from app.compute.store import Store
from app.measuring.results import measures_of
from app.reports.reconstruction import write_reconstruction_report
from packetmesh.files import write_json
from packetmesh.progress import Progress
from pipeline.config import Baseline
from pipeline.folders.run import (
    CLOUD_FILES,
    clouds_of,
    config_of,
    metrics_of,
    write_baseline,
    write_run_folder,
)
from pipeline.io.clouds import write_cloud
from pipeline.io.meshes import write_mesh
from pipeline.reconstruct import Reconstruction, iterate_reconstruction
from pipeline.stages import dressed
from pipeline.types import SurfaceResult


def export_job(store: Store, spec: Spec, name: str, shown: Shown = "after") -> Generator[Any, None, bytes]:
    """Return the content of the file called ``name``.

    Args:
        store: store of the results.
        spec: settings and source.
        name: ``config.json``, ``metrics.json``, one of ``CLOUD_FILES``, ``surface.`` with the suffix of any
            mesh format, or ``run.zip`` for the whole run folder.
        shown: the surface that ``surface.*`` holds; a baseline is added to ``run.zip``.
    """
    if name == "config.json":
        return (json.dumps(config_of(spec), indent=2) + "\n").encode()
    with tempfile.TemporaryDirectory(prefix=".", dir=store.folder) as folder:
        path = Path(folder, name)
        if name in CLOUD_FILES:
            clouds = yield from store.stage(spec, "clouds")
            write_cloud(path, clouds_of(clouds)[name])
        elif name.startswith("surface."):
            surface, rig, placement = yield from store.stages(spec, shown, "rig", "placement")
            write_mesh(path, surface, dressed(rig, placement, surface) if path.suffix == ".glb" else None)
        else:
            result = yield from iterate_reconstruction(spec, store)
            metrics = metrics_of(result)
            if name == "metrics.json":
                write_json(path, metrics)
            else:
                baseline = (yield from store.stage(spec, shown)) if shown in get_args(Baseline) else None
                measures = (yield from measures_of(store, spec)) if spec.tape.taken else None
                yield Progress("writing the run folder", 0.95)
                _archive(result, metrics, path, shown, baseline, measures)
        return path.read_bytes()


def _archive(
    result: Reconstruction,
    metrics: dict[str, Any],
    path: Path,
    shown: Shown,
    baseline: SurfaceResult | None,
    measures: dict[str, Any] | None,
) -> None:
    run = path.parent / "run"
    run.mkdir()
    texture = dressed(result.rig, result.placement, result.after)
    write_run_folder(result, metrics, run, texture=texture)
    write_reconstruction_report(result, metrics, run / "report.html", texture, measures)
    if measures is not None:
        write_json(run / "measures.json", measures)
    if baseline is not None:
        write_baseline(shown, baseline, result, run)
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for file in sorted(run.iterdir()):
            archive.write(file, f"run/{file.name}")
