"""Output folder of a reconstruction: settings, metrics, clouds and surfaces."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Any, get_args

import numpy as np

from packetmesh.errors import InputError
from packetmesh.files import delete_unfinished, file_trouble, write_json
from packetmesh.memory import peak_memory_bytes
from packetmesh.settings import settings
from pipeline.config import Baseline
from pipeline.folders.inputs import check_inputs_stay
from pipeline.folders.keyframes import FOLDER as KEYFRAMES
from pipeline.folders.keyframes import delete_keyframes
from pipeline.folders.walk import FILES as WALK_FILES
from pipeline.folders.walk import walk_metrics, write_trajectory
from pipeline.importing import is_recording
from pipeline.io.clouds import write_cloud
from pipeline.io.meshes import write_mesh
from pipeline.io.rigs import is_rig
from pipeline.io.textures import Texture
from pipeline.measuring.surface import MEASURING, measured_surface, write_measured
from pipeline.merging import MergedClouds
from pipeline.placement.agreement import Agreement
from pipeline.placement.outcome import NodeRegistration, NodeVerdict
from pipeline.reconstruct import Reconstruction
from pipeline.sources import Calibrated, FileSource, RigFolder
from pipeline.spec import Spec
from pipeline.stages import dressed
from pipeline.types import PointCloud, PointSource, RgbdFrame, SurfaceResult

METRICS = "metrics.json"
CLOUD_FILES = ("sensor.ply", "inferred.ply", "fused.ply")
MESH_FILES = ("surface_before.ply", "surface_after.ply", "surface.glb")
BASELINE_FILES = tuple(
    f"surface_{name}{suffix}" for name in get_args(Baseline) for suffix in (".ply", ".glb")
)
REPORT, PICTURE, TASK = "report.html", "picture.jpg", "task.json"
"""Report of one rig; of one of many rigs also a picture of its surface, and the record of its inputs."""
MOMENTS = "moments.csv"
DELIVERY_FILES = (MOMENTS, "delivery.html", "delivery.gif")
SETTINGS = "config.json"
FILES = (METRICS, SETTINGS, "poses.json", *WALK_FILES, *CLOUD_FILES, *MESH_FILES, MEASURING)
OTHER_FILES = (TASK, *BASELINE_FILES, REPORT, PICTURE, *DELIVERY_FILES)
"""Files that every run writes, and those that some runs of ``reconstruct`` and ``deliver`` write."""
IMPORTED = "imported"
"""Folder of a run with the rig that was imported from its recording."""


def is_imported(source: FileSource) -> bool:
    """Return whether a source is a recording that is given as a rig, and is imported before it is used."""
    if isinstance(source, Calibrated):
        return is_imported(source.source)
    return isinstance(source, RigFolder) and not is_rig(Path(source.path)) and is_recording(Path(source.path))


def check_run_folder(folder: Path, source: FileSource) -> None:
    """Check that neither ``clear_run_folder`` nor an import would delete images in a run folder.

    Raises:
        InputError: the folder is a rig or a recording, or the source is in a part of it that is cleared.
    """
    check_no_images(folder)
    cleared = (*FILES, *OTHER_FILES, KEYFRAMES, *([IMPORTED] if is_imported(source) else []))
    check_inputs_stay([folder / name for name in cleared], source.paths)


def check_no_images(folder: Path) -> None:
    """Check that a folder for results is not one of images.

    Raises:
        InputError: it is a rig or a recording.
    """
    if is_rig(folder) or is_recording(folder):
        raise InputError(
            f"{folder} is a rig or a recording, and the results would replace some of its files; try another "
            "place for --out"
        )


def clear_run_folder(folder: Path) -> None:
    """Delete the files and keyframes of an earlier run, complete or interrupted, the metrics first.

    Those that only some runs write are deleted if the folder has the settings of a run: others may be the
    user's.

    Raises:
        InputError: the folder cannot be written.
    """
    others = OTHER_FILES if (folder / SETTINGS).is_file() else ()
    try:
        for name in (*others, *FILES):
            (folder / name).unlink(missing_ok=True)
        delete_keyframes(folder)
        delete_unfinished(folder)
    except OSError as error:
        raise InputError(file_trouble(error)) from None


def write_run_folder(
    reconstruction: Reconstruction,
    metrics: dict[str, Any],
    folder: Path,
    config: dict[str, Any] | None = None,
    texture: Texture | None = None,
) -> list[Path]:
    """Write everything but the report and keyframes into ``folder``, each file whole or not at all.

    Call ``clear_run_folder`` first if the folder may contain an earlier run. The metrics are written last: if
    they exist, all these files exist and belong to one run. A surface without triangles, if the ball rests
    nowhere, gets no mesh file.

    Args:
        reconstruction: the reconstruction to write.
        metrics: its metrics.
        folder: output folder, created if it is missing.
        config: record of the run's settings; None uses ``config_of``.
        texture: photographs on the surface after fusion; None computes them.

    Returns:
        The files written.

    Raises:
        InputError: the folder cannot be written.
    """
    files = [folder / SETTINGS, folder / "poses.json"]
    write_json(files[0], config or config_of(reconstruction.spec))
    write_json(files[1], metrics["poses"])
    if reconstruction.rig.walk is not None:
        files += write_trajectory(folder, reconstruction.rig.walk)
    for name, cloud in clouds_of(reconstruction.clouds).items():
        files.append(folder / name)
        write_cloud(files[-1], cloud)
    meshes = zip(MESH_FILES, (reconstruction.before, reconstruction.after, reconstruction.after), strict=True)
    texture = texture or dressed(reconstruction.rig, reconstruction.placement, reconstruction.after)
    for name, mesh in meshes:
        if len(mesh.triangles):
            files.append(folder / name)
            write_mesh(files[-1], mesh, texture if name.endswith(".glb") else None)
    if len(reconstruction.after.triangles):
        files.append(folder / MEASURING)
        write_measured(files[-1], measured_surface(reconstruction))
    write_json(folder / METRICS, metrics)
    return [*files, folder / METRICS]


def write_baseline(name: str, surface: SurfaceResult, reconstruction: Reconstruction, folder: Path) -> None:
    """Write the surface of a baseline next to the run's own, as PLY and GLB."""
    texture = dressed(reconstruction.rig, reconstruction.placement, surface)
    write_mesh(folder / f"surface_{name}.ply", surface)
    write_mesh(folder / f"surface_{name}.glb", surface, texture)


def config_of(spec: Spec) -> dict[str, Any]:
    """Return the record of a run's settings; its file can be used as a preset."""
    return {"scene": spec.source.title, "preset": spec.preset, "settings": settings(spec.config)}


def clouds_of(clouds: MergedClouds) -> dict[str, PointCloud]:
    """Return the clouds of a run by the names of their files.

    Without labels of the points' source, the inferred cloud is the whole fused one.
    """
    fused = clouds.fused
    inferred = fused.select(fused.source == PointSource.INFERRED) if fused.source is not None else fused
    return dict(zip(CLOUD_FILES, (clouds.sensor, inferred, fused), strict=True))


def metrics_of(reconstruction: Reconstruction) -> dict[str, Any]:
    """Return the metrics of a run: lengths in metres, shares from 0 to 1."""
    before, after, placement = reconstruction.before, reconstruction.after, reconstruction.placement
    truth = None
    if reconstruction.truth_before or reconstruction.truth_after:
        truth = {"surface_before": reconstruction.truth_before, "surface_after": reconstruction.truth_after}
    walk = reconstruction.rig.walk
    recording = {} if walk is None else {"recording": walk_metrics(walk, reconstruction.timings_s["rig"])}
    return recording | {
        "scene": reconstruction.spec.source.title,
        "preset": reconstruction.spec.preset,
        "nodes": [
            {
                "name": node.name,
                "sensor_points": len(node.sensor),
                "sensor_coverage": frame.depth.coverage,
                "outliers": len(node.filtered.outliers),
                "kept_share": float(node.filtered.keep.mean()),
                "provider": node.network.provider,
                "alignment": {
                    "mode": node.alignment.mode,
                    "residual_rms_m": node.alignment.residual_rms_m,
                    "coefficients": node.alignment.coefficients,
                },
                "filled_points": int(np.sum(node.fused.source == PointSource.INFERRED)),
                "place": _place(verdict),
                "notes": frame.notes,
            }
            | _averaged(frame)
            for node, frame, verdict in zip(
                reconstruction.nodes, reconstruction.rig.frames, placement.verdicts, strict=True
            )
        ],
        "registration": [_registration(item, reconstruction) for item in placement.registrations],
        "agreement": [
            {"nodes": [pair.source, pair.target]} | _agreement(pair.agreement)
            for pair in placement.agreements
        ],
        "poses": dict(
            placement.placed(
                [
                    (node.name, pose)
                    for node, pose in zip(reconstruction.nodes, placement.T_world_camera, strict=True)
                ]
            )
        ),
        "spacing": {"r_F_m": reconstruction.clouds.r_F_m, "sigma_D_m": reconstruction.clouds.sigma_D_m},
        "surface_before": surface_metrics(before),
        "surface_after": surface_metrics(after),
        "measured": asdict(reconstruction.kept)
        | {"agreement_between_nodes": placement.agreement.within_2pct_share},
        "truth": truth,
        "timings_s": reconstruction.timings_s,
        "peak_memory_bytes": peak_memory_bytes(),
    }


def _averaged(frame: RgbdFrame) -> dict[str, Any]:
    """Return the numbers of a camera that stands; nothing for a single image."""
    averaging = frame.averaging
    if averaging is None:
        return {}
    return {
        "averaged": {
            "frames": averaging.frames,
            "moving_share": averaging.moving_share,
            "flickering_share": averaging.flickering_share,
            "median_sd_m": averaging.median_sd_m,
        }
    }


def _registration(item: NodeRegistration, reconstruction: Reconstruction) -> dict[str, Any]:
    steps = item.result.steps
    config = reconstruction.spec.config.node_registration
    return {
        "source": item.source,
        "target": item.target,
        "method": f"{config.method}/{config.metric}",
        "iterations": len(steps),
        "stop_reason": item.result.stop_reason,
        "rmse_m": steps[-1].rmse_m if steps else None,
        "T_target_source": item.result.T_target_source,
        "loop_error_m": item.loop_error_m,
        "used": item.used,
    } | _agreement(item.agreement)


def _agreement(found: Agreement) -> dict[str, float]:
    """Return the agreement of two cameras' measurements as metrics."""
    return {"overlap_share": found.overlap_share, "within_2pct_share": found.within_2pct_share}


def _place(verdict: NodeVerdict) -> dict[str, Any]:
    """Return whether a node's pose was found, and its agreement with all other nodes."""
    return {"placed": verdict.placed, "sentence": verdict.sentence} | _agreement(verdict.agreement)


def surface_metrics(surface: SurfaceResult) -> dict[str, Any]:
    """Return the measures of a surface by name."""
    return {
        "radii_m": surface.radii_m,
        "vertices": len(surface.vertices_m),
        "triangles": len(surface.triangles),
    } | asdict(surface.quality)
