"""A calibration on disk: a rig folder without images, whose files take the place of a rig's own.

``CAL/node_00/{intrinsics.json, pose.txt, depth_intrinsics.json, extrinsics.json, depth_correction.json}``,
``CAL/node_01/...``: each node has those that were calibrated.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TypedDict, cast

from packetmesh.errors import InputError
from pipeline.io.extrinsics import write_extrinsics
from pipeline.io.intrinsics import write_intrinsics
from pipeline.io.poses import write_pose
from pipeline.types import AnyPath, CameraIntrinsics, FloatArray

FILES = {
    "intrinsics": "intrinsics.json",
    "pose": "pose.txt",
    "depth_intrinsics": "depth_intrinsics.json",
    "extrinsics": "extrinsics.json",
    "depth_correction": "depth_correction.json",
}
"""Of a node, by what ``load_frame`` calls them: its camera, where it stands, the separate camera of its
depth, where that one stands beside it, and the depth sensor's own bias."""


class NodeFiles(TypedDict, total=False):
    """Those of ``FILES`` that there are."""

    intrinsics: AnyPath
    pose: AnyPath
    depth_intrinsics: AnyPath
    extrinsics: AnyPath
    depth_correction: AnyPath


def node_files(folder: Path) -> NodeFiles:
    """The files in a node's folder."""
    found = {name: folder / file for name, file in FILES.items() if (folder / file).exists()}
    return cast(NodeFiles, found)


@dataclass(frozen=True, slots=True)
class CalibratedNode:
    """What a calibration says of a node."""

    intrinsics: CameraIntrinsics | None
    """None leaves the rig's own."""
    T_world_camera: FloatArray | None = None
    """(4, 4), metres; None leaves the rig's own pose."""
    depth_intrinsics: CameraIntrinsics | None = None
    """Of a separate depth camera, whose images are not registered to the colour camera's."""
    T_color_depth: FloatArray | None = None
    """(4, 4), metres, where that one stands."""


def write_calibration(folder: AnyPath, nodes: Mapping[str, CalibratedNode]) -> None:
    """Write a folder that ``load_rig(..., calibration=folder)`` lays over a rig.

    Args:
        folder: made if it is missing.
        nodes: by name, node_00 and so on.

    Raises:
        InputError: the folder cannot be written.

    >>> import packetmesh as pm
    >>> camera = pm.load_demo("office").frames[0].intrinsics
    >>> pm.write_calibration("calibration", {"node_00": pm.CalibratedNode(camera)})
    """
    for name, node in nodes.items():
        own = Path(folder) / name
        if node.intrinsics is not None:
            write_intrinsics(own / "intrinsics.json", node.intrinsics)
        if node.T_world_camera is not None:
            write_pose(own / "pose.txt", node.T_world_camera)
        if node.depth_intrinsics is not None and node.T_color_depth is not None:
            write_intrinsics(own / "depth_intrinsics.json", node.depth_intrinsics)
            write_extrinsics(own / "extrinsics.json", node.T_color_depth)


def calibration_files(folder: AnyPath, nodes: Sequence[str]) -> dict[str, NodeFiles]:
    """The files of a calibration by the node's name.

    Args:
        folder: as ``write_calibration`` makes it.
        nodes: names of the rig's nodes.

    Raises:
        InputError: no folder, no node with a file in it, a node that the rig has not, or poses of some nodes
            only.
    """
    folder = Path(folder)
    if not folder.is_dir():
        raise InputError(f"The calibration folder {folder} does not exist; check the path")
    folders = sorted(one for one in folder.glob("node_*") if one.is_dir())
    found = {one.name: files for one in folders if (files := node_files(one))}
    if not found:
        raise InputError(
            f"The calibration folder {folder} holds no node; try {folder.name}/node_00/ with "
            "intrinsics.json, as packetmesh calibrate writes it"
        )
    strange = [name for name in found if name not in nodes]
    if strange:
        raise InputError(
            f"The calibration {folder} is of {', '.join(strange)}, and the rig has {', '.join(nodes)}; try "
            "the calibration of this rig, or rename the folders of its nodes"
        )
    placed = [name for name in nodes if "pose" in found.get(name, NodeFiles())]
    if placed and len(placed) < len(nodes):
        rest = ", ".join(name for name in nodes if name not in placed)
        raise InputError(
            f"The calibration {folder} has poses of {', '.join(placed)} but none of {rest}, which would "
            "be in another world; calibrate all nodes together, or remove its pose.txt files"
        )
    return found
