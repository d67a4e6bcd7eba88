"""Output folder of a camera's calibration."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from packetmesh.errors import InputError
from packetmesh.files import atomic_path, finite
from pipeline.calibration.assess import Trust
from pipeline.calibration.from_images import CameraReport
from pipeline.io.calibrations import delete_files
from pipeline.io.camera_files import WRITERS, write_camera
from pipeline.io.depth_correction import DEPTH_CORRECTION, write_depth_correction
from pipeline.io.intrinsics import write_intrinsics

METRICS = "metrics.json"


def metrics(report: CameraReport, trust: Trust | None = None) -> dict[str, Any]:
    """Return the values that ``--json`` prints: the camera, and under ``trust`` its assessment."""
    return report.metrics() | ({} if trust is None else {"trust": trust.metrics()})


def write_camera_folder(report: CameraReport, folder: Path, trust: Trust | None = None) -> list[str]:
    """Write intrinsics.json, depth_correction.json if the bias is known, and files for other programs; write
    metrics.json last, so that it exists only if all files do.

    Those of an earlier calibration are deleted first: a file that this one does not write would belong to
    another lens.

    Returns:
        A sentence for each file whose format cannot store the lens.

    Raises:
        InputError: the folder cannot be written.
    """
    delete_files(folder, (METRICS, DEPTH_CORRECTION, *WRITERS))
    missing = _write_cameras(report, folder)
    with atomic_path(folder / METRICS) as sibling:
        sibling.write_text(json.dumps(finite(metrics(report, trust)), indent=1, allow_nan=False) + "\n")
    return missing


def _write_cameras(report: CameraReport, folder: Path) -> list[str]:
    if report.depth is not None:
        write_depth_correction(folder / DEPTH_CORRECTION, report.depth.correction)
    camera = report.intrinsics
    write_intrinsics(folder / "intrinsics.json", camera, report.calibration.focal_sd)
    missing = []
    for name in WRITERS:
        try:
            write_camera(folder / name, camera, name)
        except InputError as error:
            missing.append(f"{name} is not written: {error}")
    return missing
