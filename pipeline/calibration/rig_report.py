"""Output folder of a calibration of several cameras."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from packetmesh.errors import InputError
from packetmesh.files import atomic_path, finite
from pipeline.calibration.assess import Trust
from pipeline.calibration.report import METRICS, metrics, write_camera_folder
from pipeline.calibration.rig_from_images import RigReport
from pipeline.calibration.shots import INFRARED
from pipeline.io.calibrations import check_calibration_folder, delete_files, write_calibration
from pipeline.io.poses import read_pose
from pipeline.kernels.geometry import LEVEL_POSE
from pipeline.types import AnyPath, FloatArray

NO_TRUST: Mapping[str, Trust] = {}


def rig_metrics(report: RigReport, trust: Mapping[str, Trust] = NO_TRUST) -> dict[str, Any]:
    """Return the values that ``--json`` prints: every camera as for a single one, and their relative poses.

    Args:
        report: report of all cameras.
        trust: assessments by camera.
    """
    cameras = {name: metrics(one, trust.get(name)) for name, one in report.cameras.items()}
    return report.metrics() | {"cameras": cameras}


def write_rig_folder(
    report: RigReport,
    folder: Path,
    T_world_first: FloatArray = LEVEL_POSE,
    trust: Mapping[str, Trust] = NO_TRUST,
) -> list[str]:
    """Write the files of every node for ``load_rig(..., calibration=folder)`` and for other programs, and
    metrics.json last; that of an earlier calibration is deleted first.

    Args:
        report: report of all cameras.
        folder: output folder.
        T_world_first: (4, 4) pose of the first camera.
        trust: assessments by camera.

    Returns:
        A sentence for each file whose format cannot store the lens.

    Raises:
        InputError: the folder cannot be written, is a rig with images, or has a calibration of other nodes.
    """
    nodes = report.nodes(T_world_first)
    check_calibration_folder(folder, nodes)
    delete_files(folder, (METRICS,))
    write_calibration(folder, nodes)
    sentences = []
    for name, one in report.cameras.items():
        if not name.endswith(INFRARED):
            told = write_camera_folder(one, folder / name, trust.get(name))
            sentences += [f"{name}: {sentence}" for sentence in told]
    with atomic_path(folder / METRICS) as sibling:
        sibling.write_text(json.dumps(finite(rig_metrics(report, trust)), indent=1, allow_nan=False) + "\n")
    return sentences


def pose_like(rig: AnyPath | None, node: str) -> FloatArray:
    """Return the (4, 4) pose of a node of an existing rig, in its world frame; LEVEL_POSE without a rig.

    Raises:
        InputError: the rig has no such node, or the node has no readable pose.
    """
    if rig is None:
        return LEVEL_POSE
    path = Path(rig) / node / "pose.txt"
    if not path.exists():
        raise InputError(
            f"{rig} has no {node}/pose.txt by which to place the cameras; try another rig, or none"
        )
    return read_pose(path)
