"""Files to take along, made in a computing process and handed over as bytes."""

from __future__ import annotations

import contextlib
import io
import json
import tempfile
import zipfile
from collections.abc import Generator
from pathlib import Path
from typing import Any

import numpy as np
import viser

from app.drawing.meshes import photographed_glb
from app.records import Shown
from app.reports.reconstruction import write_reconstruction_report
from app.state import Spec
from app.store import Store
from packetmesh.errors import InputError
from packetmesh.files import write_json
from packetmesh.progress import Progress
from pipeline.io.clouds import write_cloud
from pipeline.io.meshes import write_mesh
from pipeline.reconstruct import Reconstruction, iterate_reconstruction
from pipeline.run_folder import CLOUD_FILES, clouds_of, config_of, metrics_of, write_run_folder
from pipeline.stages import dressed
from pipeline.texture import Texture
from pipeline.types import SurfaceResult


def export_job(store: Store, spec: Spec, name: str, shown: Shown = "after") -> Generator[Any, None, bytes]:
    """The content of the file called ``name``.

    Args:
        store: where results are kept.
        spec: what is asked for.
        name: a file of the run folder, ``run.zip`` for all of it, ``scene.html``, or ``surface.`` with the
            suffix of any mesh format.
        shown: the surface that ``surface.*`` and ``scene.html`` hold.

    Raises:
        InputError: the surface has no triangle.
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
        elif name == "scene.html":
            surface, rig, placement = yield from store.stages(spec, shown, "rig", "placement")
            yield Progress("writing the page", 0.8)
            path.write_text(_page(surface, dressed(rig, placement, surface)), encoding="utf-8")
        else:
            result = yield from iterate_reconstruction(spec, store)
            metrics = metrics_of(result)
            if name == "metrics.json":
                write_json(path, metrics)
            else:
                yield Progress("writing the run folder", 0.8)
                _archive(result, metrics, path)
        return path.read_bytes()


def _archive(result: Reconstruction, metrics: dict[str, Any], path: Path) -> None:
    run = path.parent / "run"
    run.mkdir()
    write_run_folder(result, metrics, run)
    write_reconstruction_report(result, metrics, run / "report.html")
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for file in sorted(run.iterdir()):
            archive.write(file, f"run/{file.name}")


def _page(surface: SurfaceResult, texture: Texture) -> str:
    """A self-contained page with a surface, drawn by a server that nobody visits."""
    if not len(surface.triangles):
        raise InputError("The surface has no triangle to show; try a larger ball radius")
    with contextlib.redirect_stdout(io.StringIO()):
        server = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
        try:
            server.scene.set_up_direction("+z")
            middle_m = surface.vertices_m.mean(axis=0)
            extent_m = float(np.ptp(surface.vertices_m, axis=0).max())
            server.initial_camera.position = middle_m + extent_m * np.array([-0.4, -0.9, 0.6])
            server.initial_camera.look_at = middle_m
            server.scene.add_glb("/surface", photographed_glb(surface, texture))
            return server.scene.as_html()
        finally:
            server.stop()
