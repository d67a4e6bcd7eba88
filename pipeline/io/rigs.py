"""Rigs on disk: ``RIG/node_00/{color.png, depth.png, intrinsics.json, pose.txt}`` and so on.

A node's depth is corrected by ``depth_correction.json`` if it has one. If a separate depth camera took
``depth.png``, so that it is not registered to the colour image, the node also has
``depth_intrinsics.json`` and ``extrinsics.json``.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from packetmesh.errors import InputError
from pipeline.io.calibrations import FILES, NodeFiles, calibration_files, delete_files, node_files
from pipeline.io.depth_correction import (
    DepthCorrection,
    read_depth_correction,
    write_depth_correction,
)
from pipeline.io.depth_to_color import register_depth
from pipeline.io.extrinsics import read_extrinsics_noted
from pipeline.io.images import images_in, read_color, read_depth_noted, write_color, write_depth_mm
from pipeline.io.intrinsics import read_focal_sd, read_intrinsics, write_intrinsics
from pipeline.io.poses import read_pose_noted, write_pose
from pipeline.io.same_view import depth_camera_of, same_view_note
from pipeline.io.truth import INTRINSICS_NAME, MESH_NAME, POSE_NAME, read_truth, write_truth
from pipeline.kernels.geometry import LEVEL_POSE
from pipeline.types import MAX_NODES, AnyPath, CameraIntrinsics, DepthMap, RgbdFrame, Rig


def load_frame(
    color: AnyPath,
    depth: AnyPath,
    intrinsics: AnyPath,
    depth_scale: float | None = None,
    name: str = "node_00",
    *,
    pose: AnyPath | None = None,
    depth_intrinsics: AnyPath | None = None,
    extrinsics: AnyPath | None = None,
    depth_correction: AnyPath | None = None,
) -> RgbdFrame:
    """Load one RGB-D pair; without a pose it is at the origin, upright, looking along +y.

    Args:
        color: (H, W) image.
        depth: (H, W) image, 0 where the depth is unknown. It may show the same view in another number of
            pixels, in proportion; its size may be any if it is not registered.
        intrinsics: JSON with fx, fy, cx and cy, Open3D JSON, ROS camera_info or a bare matrix, pixels.
        depth_scale: depth units per metre; by default whole numbers are millimetres and floating-point
            numbers metres.
        name: name of the node.
        pose: 4 x 4 T_world_camera, metres.
        depth_intrinsics: intrinsics of the depth camera, if depth is not registered to colour.
        extrinsics: JSON with ``T_color_depth``, the depth camera's pose; give both of these or none.
        depth_correction: bias of the depth sensor, which is corrected first (SPEC 1.5).

    Raises:
        InputError: a file cannot be used, or images and intrinsics have different sizes.

    >>> import packetmesh as pm
    >>> pm.save_rig("office", pm.load_demo("office"))
    >>> node = "office/node_00"
    >>> frame = pm.load_frame(f"{node}/color.png", f"{node}/depth.png", f"{node}/intrinsics.json")
    >>> frame.rgb.shape[:2] == frame.depth.z_m.shape
    True
    """
    rgb = read_color(color)
    camera = read_intrinsics(intrinsics, rgb.shape[1::-1])
    read = read_depth_noted(depth, depth_scale)
    sensed, noise, sds = read.depth, None, [read_focal_sd(intrinsics)]
    if depth_correction is not None:
        correction = read_depth_correction(depth_correction)
        sensed, noise = correction.apply(sensed), correction.noise
        sds.append(correction.scale_sd)
    _check_size(camera, intrinsics, "colour image", color, rgb.shape)
    if depth_intrinsics is None and extrinsics is None:
        sensed, notes = _same_view(sensed, depth, camera, color)
    else:
        sensed, notes = _registered(sensed, depth, camera, depth_intrinsics, extrinsics)
    T_world_camera, pose_notes = (LEVEL_POSE.copy(), ()) if pose is None else read_pose_noted(pose)
    notes = (*read.notes, *notes, *pose_notes)
    return RgbdFrame(
        name,
        rgb,
        sensed,
        camera,
        T_world_camera,
        noise=noise,
        pose_known=pose is not None,
        notes=notes,
        scale_sd=max((sd for sd in sds if sd is not None), default=None),
    )


def _same_view(
    sensed: DepthMap, depth: AnyPath, camera: CameraIntrinsics, color: AnyPath
) -> tuple[DepthMap, tuple[str, ...]]:
    """Return depth of the colour camera's view on its pixel grid, and a note if it was resized."""
    remedy = "try files of the same proportions, or the depth camera's own intrinsics and extrinsics"
    depth_camera = depth_camera_of(camera, sensed.z_m.shape, depth, color, remedy)
    if depth_camera is None:
        return sensed, ()
    return register_depth(sensed, depth_camera, camera, np.eye(4)), (same_view_note(camera, depth_camera),)


def _registered(
    sensed: DepthMap,
    depth: AnyPath,
    color_camera: CameraIntrinsics,
    depth_intrinsics: AnyPath | None,
    extrinsics: AnyPath | None,
) -> tuple[DepthMap, tuple[str, ...]]:
    """Return depth of a separate camera on the colour camera's pixel grid, and notes on its pose."""
    if depth_intrinsics is None or extrinsics is None:
        given, missing = "extrinsics", "depth intrinsics"
        if extrinsics is None:
            given, missing = missing, given
        raise InputError(
            f"The depth image {depth} comes with {given} but without {missing}; try both if it is not "
            "registered to the colour image, and none if it is"
        )
    depth_camera = read_intrinsics(depth_intrinsics, sensed.z_m.shape[::-1])
    _check_size(depth_camera, depth_intrinsics, "depth image", depth, sensed.z_m.shape)
    T_color_depth, notes = read_extrinsics_noted(extrinsics)
    seen = register_depth(sensed, depth_camera, color_camera, T_color_depth)
    if not seen.valid.any():
        raise InputError(
            f"The colour camera sees nothing of the depth image {depth}; check that {extrinsics} is in "
            "metres and leads from the depth camera's frame to the colour camera's"
        )
    return seen, notes


def _check_size(
    camera: CameraIntrinsics, intrinsics: AnyPath, what: str, image: AnyPath, shape: tuple[int, ...]
) -> None:
    """Raise an InputError if a camera is for images of another size."""
    if (camera.height_px, camera.width_px) != shape[:2]:
        upright = (camera.width_px, camera.height_px) == shape[:2]
        remedy = "to turn the image by 90 degrees, or " if upright else ""
        raise InputError(
            f"The intrinsics file {intrinsics} is for {camera.width_px} x {camera.height_px} pixels but the "
            f"{what} {image} has {shape[1]} x {shape[0]}; try {remedy}the intrinsics of images of that size"
        )


def load_rig(directory: AnyPath, calibration: AnyPath | None = None, depth_scale: float | None = None) -> Rig:
    """Load the nodes below ``directory``, ordered by their folders' names.

    Args:
        directory: contains node_00/{color.png, depth.png, intrinsics.json}, node_01/... and, if the poses
            are known, node_NN/pose.txt with a 4 x 4 T_world_camera, metres.
        calibration: a folder whose node_NN/intrinsics.json, pose.txt and so on replace the rig's own; the
            truth of a rendered rig does not change.
        depth_scale: depth units per metre of every node, as for ``load_frame``.

    Raises:
        InputError: the folder is missing, has no node or more than ``MAX_NODES``, a node's file cannot be
            used, or the calibration is for another rig.

    >>> import packetmesh as pm
    >>> pm.save_rig("office", pm.load_demo("office"))
    >>> [frame.name for frame in pm.load_rig("office").frames]
    ['node_00', 'node_01', 'node_02']
    """
    directory = Path(directory)
    folders = nodes_in(directory)
    over = {} if calibration is None else calibration_files(calibration, [folder.name for folder in folders])
    frames = tuple(load_node(folder, over.get(folder.name, NodeFiles()), depth_scale) for folder in folders)
    return Rig(directory.resolve().name, frames, read_truth(directory, [frame.name for frame in frames]))


def nodes_in(directory: Path) -> list[Path]:
    """Return the folders of a rig's nodes, node_2 before node_10.

    Raises:
        InputError: the folder is missing, has no node or more than ``MAX_NODES``.
    """
    if directory.is_file():
        raise InputError(f"The rig {directory} is a file; packetmesh import makes a rig of a recording")
    if not directory.is_dir():
        raise InputError(f"The rig folder {directory} does not exist; check the path")
    folders = _node_folders(directory)
    if not folders:
        raise InputError(
            f"The rig folder {directory} holds no node; try {directory.name}/node_00/ with color.png, "
            "depth.png and intrinsics.json"
        )
    if len(folders) > MAX_NODES:
        raise InputError(
            f"The rig folder {directory} holds {len(folders)} nodes; try to move some away, so that at most "
            f"{MAX_NODES} remain"
        )
    return folders


def is_rig(path: Path) -> bool:
    """Return whether a folder contains nodes."""
    return any(node.is_dir() for node in path.glob("node_*"))


def is_pair(path: Path) -> bool:
    """Return whether a folder is that of one node: colour image, depth image and intrinsics."""
    images = (_image_in(path, stem).is_file() for stem in ("color", "depth"))
    return path.is_dir() and _intrinsics_in(path).is_file() and all(images)


def save_rig(directory: AnyPath, rig: Rig) -> None:
    """Write every frame of ``rig`` as ``directory/node_NN``, and the rig's truth if it has one.

    An older rig of this folder is replaced. Depth is saved corrected and registered to colour.

    Raises:
        InputError: the folder cannot be written, or contains nodes of a larger rig.

    >>> import packetmesh as pm
    >>> pm.save_rig("copy", pm.Rig("first node", pm.load_demo("office").frames[:1]))
    >>> len(pm.load_rig("copy").frames)
    1
    """
    directory = Path(directory)
    names = [f"node_{index:02d}" for index in range(len(rig.frames))]
    for folder in _node_folders(directory):
        if folder.name not in names:
            raise InputError(f"{directory} already holds {folder.name} of another rig; try an empty folder")
    delete_files(directory, [MESH_NAME])
    for name, frame in zip(names, rig.frames, strict=True):
        folder = directory / name
        delete_files(folder, (*FILES.values(), POSE_NAME, INTRINSICS_NAME))
        write_color(folder / "color.png", frame.rgb)
        write_depth_mm(folder / "depth.png", frame.depth)
        write_intrinsics(folder / FILES["intrinsics"], frame.intrinsics, frame.scale_sd)
        if frame.pose_known:
            write_pose(folder / FILES["pose"], frame.T_world_camera)
        if frame.noise is not None:
            size_px = (frame.intrinsics.width_px, frame.intrinsics.height_px)
            correction = DepthCorrection(size_px, noise=frame.noise)
            write_depth_correction(folder / FILES["depth_correction"], correction)
    if rig.truth is not None:
        write_truth(directory, dict(zip(names, rig.frames, strict=True)), rig.truth)


def _node_folders(directory: Path) -> list[Path]:
    """Return the nodes' folders, node_2 before node_10."""
    folders = (folder for folder in directory.glob("node_*") if folder.is_dir())
    return sorted(folders, key=lambda folder: _natural(folder.name))


def _natural(name: str) -> list[tuple[str, int]]:
    """Return a key that sorts names by the values of the numbers in them, and by the other letters."""
    return [(letters, int(number or -1)) for letters, number in re.findall(r"(\D*)(\d*)", name)]


def load_node(folder: Path, over: NodeFiles, depth_scale: float | None) -> RgbdFrame:
    """Load one node of a rig.

    Args:
        folder: contains color.png, depth.png, intrinsics.json and, if they are known, pose.txt and so on.
        over: files that replace its own.
        depth_scale: depth units per metre, as for ``load_frame``.

    Raises:
        InputError: a file is missing or cannot be used.
    """
    files: NodeFiles = {"intrinsics": _intrinsics_in(folder), **node_files(folder), **over}
    for stem in ("color", "depth"):
        names = [file.name for file in images_in(folder, stem)]
        if len(names) > 1 and f"{stem}.png" not in names:
            raise InputError(f"The node {folder} has several images, {', '.join(names)}; try to keep one")
    color, depth = (_image_in(folder, stem) for stem in ("color", "depth"))
    return load_frame(color, depth, depth_scale=depth_scale, name=folder.name, **files)


def _intrinsics_in(folder: Path) -> Path:
    """Return the path of intrinsics.json, or of the text or YAML file if it does not exist."""
    paths = [folder / f"intrinsics{suffix}" for suffix in (".json", ".txt", ".yaml", ".yml")]
    return next((path for path in paths if path.exists()), paths[0])


def _image_in(folder: Path, stem: str) -> Path:
    """Return the PNG with this stem, or the only image with another suffix if there is no PNG."""
    usual, others = folder / f"{stem}.png", images_in(folder, stem)
    return others[0] if len(others) == 1 and not usual.exists() else usual
