"""The folder that a calibration leaves."""

from __future__ import annotations

import json
from pathlib import Path

from packetmesh.errors import InputError
from packetmesh.files import atomic_path, finite
from pipeline.calibration.from_images import CameraReport
from pipeline.io.camera_files import WRITERS, write_camera
from pipeline.io.intrinsics import write_intrinsics


def write_camera_folder(report: CameraReport, folder: Path) -> list[str]:
    """Write metrics.json, intrinsics.json and the files of other programs.

    Returns:
        A sentence for each file that cannot hold the lens.

    Raises:
        InputError: the folder cannot be written.
    """
    with atomic_path(folder / "metrics.json") as sibling:
        sibling.write_text(json.dumps(finite(report.metrics()), indent=1, allow_nan=False) + "\n")
    try:
        camera = report.intrinsics
    except InputError as error:
        return [str(error)]
    write_intrinsics(folder / "intrinsics.json", camera)
    missing = []
    for name in WRITERS:
        try:
            write_camera(folder / name, camera, name)
        except InputError as error:
            missing.append(f"{name} is not written: {error}")
    return missing
