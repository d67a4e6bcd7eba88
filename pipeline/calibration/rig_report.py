"""The folder that a calibration of several cameras leaves."""

from __future__ import annotations

import json
from pathlib import Path

from packetmesh.errors import InputError
from packetmesh.files import atomic_path, finite
from pipeline.calibration.report import write_camera_folder
from pipeline.calibration.rig_from_images import INFRARED, RigReport
from pipeline.io.calibrations import write_calibration
from pipeline.io.poses import read_pose
from pipeline.io.rigs import LEVEL_POSE
from pipeline.types import AnyPath, FloatArray


def write_rig_folder(report: RigReport, folder: Path, T_world_first: FloatArray = LEVEL_POSE) -> list[str]:
    """Write metrics.json, and of every node what ``load_rig(..., calibration=folder)`` reads and its camera
    in the files of other programs.

    Args:
        report: of all cameras.
        folder: where.
        T_world_first: (4, 4) where the first camera stands.

    Returns:
        A sentence for each file that cannot hold a lens.

    Raises:
        InputError: the folder cannot be written.
    """
    with atomic_path(folder / "metrics.json") as sibling:
        sibling.write_text(json.dumps(finite(report.metrics()), indent=1, allow_nan=False) + "\n")
    sentences = []
    for name, one in report.cameras.items():
        if not name.endswith(INFRARED):
            sentences += [f"{name}: {told}" for told in write_camera_folder(one, folder / name)]
    write_calibration(folder, report.nodes(T_world_first))
    return sentences


def pose_like(rig: AnyPath | None, node: str) -> FloatArray:
    """(4, 4) pose of a rig's node, in whose world others are placed; without a rig, of a node without pose.

    Raises:
        InputError: the rig has no such node, or that one no pose.
    """
    if rig is None:
        return LEVEL_POSE
    path = Path(rig) / node / "pose.txt"
    if not path.exists():
        raise InputError(
            f"{rig} has no {node}/pose.txt by which to place the cameras; try another rig, or none"
        )
    return read_pose(path)
