"""Calibrations on disk: a rig folder without images, whose files replace those of a rig.

``CAL/node_00/{intrinsics.json, pose.txt, depth_intrinsics.json, extrinsics.json, depth_correction.json}``,
``CAL/node_01/...``: each node has the files of the parts that were calibrated.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TypedDict, cast

from packetmesh.errors import InputError
from packetmesh.files import remedy
from pipeline.io.extrinsics import write_extrinsics
from pipeline.io.images import images_in
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
"""File names of a node by parameters of ``load_frame``: its camera and pose, a separate depth camera and
its pose relative to the colour camera, and the depth sensor's bias."""


class NodeFiles(TypedDict, total=False):
    """Paths of the files of ``FILES`` that exist."""

    intrinsics: AnyPath
    pose: AnyPath
    depth_intrinsics: AnyPath
    extrinsics: AnyPath
    depth_correction: AnyPath


def node_files(folder: Path) -> NodeFiles:
    """Return the files of ``FILES`` that exist in a node's folder."""
    found = {name: folder / file for name, file in FILES.items() if (folder / file).exists()}
    return cast(NodeFiles, found)


@dataclass(frozen=True, slots=True)
class CalibratedNode:
    """Calibration of one node."""

    intrinsics: CameraIntrinsics | None
    """Intrinsics; None keeps the rig's own."""
    T_world_camera: FloatArray | None = None
    """(4, 4) pose, metres; None keeps the rig's own."""
    depth_intrinsics: CameraIntrinsics | None = None
    """Intrinsics of a separate depth camera, whose images are not registered to colour; None without one."""
    T_color_depth: FloatArray | None = None
    """(4, 4) pose of the depth camera in the colour camera's frame, metres; given with its intrinsics."""
    focal_sd: float | None = None
    """Standard error of the focal lengths as a share of them; None if unknown."""


def write_calibration(folder: AnyPath, nodes: Mapping[str, CalibratedNode]) -> None:
    """Write a calibration folder, for ``load_rig(..., calibration=folder)``.

    New intrinsics replace all of a node's earlier calibration, whose pose, depth camera and depth correction
    belong to another lens. A pose without intrinsics replaces only the pose.

    Args:
        folder: created if it is missing.
        nodes: calibrations by the nodes' names, node_00 and so on.

    Raises:
        InputError: the folder cannot be written, is a rig with images, or has a calibration of other nodes.

    >>> import packetmesh as pm
    >>> camera = pm.load_demo("office").frames[0].intrinsics
    >>> pm.write_calibration("calibration", {"node_00": pm.CalibratedNode(camera)})
    """
    check_calibration_folder(folder, nodes)
    for name, node in nodes.items():
        own = Path(folder) / name
        if node.intrinsics is not None:
            delete_files(own, FILES.values())
            write_intrinsics(own / "intrinsics.json", node.intrinsics, node.focal_sd)
        if node.T_world_camera is not None:
            write_pose(own / "pose.txt", node.T_world_camera)
        if node.depth_intrinsics is not None and node.T_color_depth is not None:
            write_intrinsics(own / "depth_intrinsics.json", node.depth_intrinsics)
            write_extrinsics(own / "extrinsics.json", node.T_color_depth)


def check_calibration_folder(folder: AnyPath, nodes: Iterable[str]) -> None:
    """Check that a calibration of these nodes can be written to a folder.

    Raises:
        InputError: a node there has images, as in a rig, or another node has a calibration.
    """
    folder = Path(folder)
    names = set(nodes)
    others = {one.name for one in folder.glob("node_*") if node_files(one)} - names
    if any(images_in(folder / name, stem) for name in names | others for stem in ("color", "depth")):
        raise InputError(
            f"{folder} has the images of a rig, whose cameras a calibration would replace; try another "
            "folder, and load the rig with it as calibration"
        )
    if others:
        raise InputError(
            f"{folder} already holds the calibration of {min(others)}, which is not among the new ones; try "
            "an empty folder"
        )


def delete_files(folder: Path, names: Iterable[str]) -> None:
    """Delete those files of a folder that exist, before newer ones are written.

    Raises:
        InputError: the folder cannot be written.
    """
    for name in names:
        try:
            (folder / name).unlink(missing_ok=True)
        except OSError as error:
            raise InputError(
                f"{folder / name} cannot be deleted ({error.strerror or error}); {remedy(error)}"
            ) from None


def calibration_files(folder: AnyPath, nodes: Sequence[str]) -> dict[str, NodeFiles]:
    """Return the files of a calibration by the nodes' names.

    Args:
        folder: a folder as ``write_calibration`` makes it.
        nodes: names of the rig's nodes.

    Raises:
        InputError: the folder is missing, contains no node with a file or a node that the rig lacks, or has
            poses for only some nodes.
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
