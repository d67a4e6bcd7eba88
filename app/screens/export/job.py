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

from app.chain import (
    BallClouds,
    RolledBalls,
    ball_clouds,
    cameras_of,
    compared,
    placed,
    prepared,
    rig_of,
    rolled,
)
from app.drawing.meshes import surface_glb
from app.reports.reconstruction import write_reconstruction_report
from app.state import Spec
from app.store import Store
from packetmesh.files import write_json
from packetmesh.progress import Progress
from packetmesh.settings import settings
from pipeline.io.clouds import write_cloud
from pipeline.io.meshes import write_mesh
from pipeline.reconstruct import Reconstruction, Surfaces
from pipeline.run_folder import metrics_of, write_run_folder
from pipeline.types import PointSource


def export_job(store: Store, spec: Spec, name: str) -> Generator[Progress | RolledBalls, None, bytes]:
    """The content of the file called ``name``."""
    if name == "config.json":
        values = {"preset": spec.preset, "settings": settings(spec.config)}
        return (json.dumps(values, indent=2) + "\n").encode()
    clouds = yield from ball_clouds(store, spec)
    with tempfile.TemporaryDirectory(dir=store.folder) as folder:
        path = Path(folder, name)
        if name in ("fused.ply", "sensor.ply", "inferred.ply"):
            _write_cloud(path, clouds)
            return path.read_bytes()
        balls = yield from rolled(store, spec)
        if name.startswith("surface."):
            write_mesh(path, balls.after)
            return path.read_bytes()
        if name == "scene.html":
            yield Progress("writing the page", 0.8)
            return _page(balls).encode()
        result = yield from _reconstruction(store, spec, clouds, balls)
        metrics = metrics_of(result, spec.source.title, spec.preset)
        if name == "metrics.json":
            write_json(path, metrics)
            return path.read_bytes()
        yield Progress("writing the run folder", 0.8)
        return _archive(result, metrics, spec, Path(folder))


def _write_cloud(path: Path, clouds: BallClouds) -> None:
    cloud = clouds.sensor if path.stem == "sensor" else clouds.fused
    if path.stem == "inferred" and cloud.source is not None:
        cloud = cloud.select(cloud.source == PointSource.INFERRED)
    write_cloud(path, cloud)


def _reconstruction(
    store: Store, spec: Spec, clouds: BallClouds, balls: RolledBalls
) -> Generator[Progress, None, Reconstruction]:
    """The stages put together as ``pipeline.reconstruct`` would hand them over."""
    rig = yield from rig_of(store, spec)
    work = yield from prepared(store, spec)
    places = yield from placed(store, spec)
    cameras = cameras_of(rig, places)
    assert balls.before is not None
    r_F_m, sigma_D_m = clouds.spacing.r_F_m, clouds.spacing.sigma_D_m
    return Reconstruction(
        rig=rig,
        config=spec.config,
        nodes=work.nodes,
        registrations=places.registrations,
        T_world_camera=places.T_world_camera,
        surfaces=Surfaces(clouds.sensor, clouds.fused, r_F_m, sigma_D_m, balls.before, balls.after),
        truth_before=compared(rig, balls.before, cameras),
        truth_after=compared(rig, balls.after, cameras),
        timings_s={"surface after fusion": balls.elapsed_s},
    )


def _archive(result: Reconstruction, metrics: dict[str, Any], spec: Spec, folder: Path) -> bytes:
    run = folder / "run"
    run.mkdir()
    write_run_folder(result, metrics, run, {"scene": spec.source.title, "preset": spec.preset})
    write_reconstruction_report(result, metrics, run / "report.html")
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
        for file in sorted(run.iterdir()):
            archive.write(file, f"run/{file.name}")
    return buffer.getvalue()


def _page(balls: RolledBalls) -> str:
    """A self-contained page with the surface after fusion, drawn by a server that nobody visits."""
    with contextlib.redirect_stdout(io.StringIO()):
        server = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
        try:
            server.scene.set_up_direction("+z")
            middle_m = balls.after.vertices_m.mean(axis=0)
            extent_m = float(np.ptp(balls.after.vertices_m, axis=0).max())
            server.initial_camera.position = middle_m + extent_m * np.array([-0.4, -0.9, 0.6])
            server.initial_camera.look_at = middle_m
            server.scene.add_glb("/surface", surface_glb(balls.after, balls.after.colors, photographed=True))
            return server.scene.as_html()
        finally:
            server.stop()
