"""Camera nodes on disk: ``RIG/node_00/{color.png, depth.png, intrinsics.json, pose.txt}`` and so on."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from packetmesh.errors import InputError
from pipeline.geometry import look_at
from pipeline.io.images import read_color, read_depth, write_color, write_depth_mm
from pipeline.io.intrinsics import read_intrinsics, write_intrinsics
from pipeline.io.poses import read_pose, write_pose
from pipeline.io.truth import read_truth, write_truth
from pipeline.types import AnyPath, RgbdFrame, Rig

MAX_NODES = 6
LEVEL_POSE = look_at(np.zeros(3), np.array([0.0, 1.0, 0.0]))
"""T_world_camera of a node without a pose file: at the origin, upright, looking along +y."""


def load_frame(
    color: AnyPath, depth: AnyPath, intrinsics: AnyPath, depth_scale: float = 1000.0, name: str = "node_00"
) -> RgbdFrame:
    """One registered RGB-D pair, at the origin, upright, looking along +y.

    Args:
        color: (H, W) image.
        depth: (H, W) 16-bit image, 0 where the depth is unknown.
        intrinsics: JSON with fx, fy, cx and cy, Open3D JSON or ROS camera_info, pixels.
        depth_scale: depth units in a metre.
        name: what the node is called.

    Raises:
        InputError: a file that cannot be used, or images and intrinsics of different sizes.

    >>> import packetmesh as pm
    >>> pm.save_rig("office", pm.load_demo("office"))
    >>> node = "office/node_00"
    >>> frame = pm.load_frame(f"{node}/color.png", f"{node}/depth.png", f"{node}/intrinsics.json")
    >>> frame.rgb.shape[:2] == frame.depth.z_m.shape
    True
    """
    camera = read_intrinsics(intrinsics)
    rgb = read_color(color)
    depth_map = read_depth(depth, depth_scale)
    size_px = (rgb.shape[1], rgb.shape[0])
    for path, what, other_px in (
        (depth, "depth image", depth_map.z_m.shape[::-1]),
        (intrinsics, "intrinsics file", (camera.width_px, camera.height_px)),
    ):
        if other_px != size_px:
            raise InputError(
                f"The {what} {path} is for {other_px[0]} x {other_px[1]} pixels but the colour image {color} "
                f"has {size_px[0]} x {size_px[1]}; try files of one size, registered to one camera"
            )
    return RgbdFrame(name, rgb, depth_map, camera, LEVEL_POSE.copy())


def load_rig(directory: AnyPath) -> Rig:
    """The nodes below ``directory`` in the order of their folders' names.

    Args:
        directory: holds node_00/{color.png, depth.png, intrinsics.json}, node_01/... and, where the poses
            are known, node_NN/pose.txt with a 4 x 4 T_world_camera, metres.

    Raises:
        InputError: no folder, no node or more than six, or a file of a node that cannot be used.

    >>> import packetmesh as pm
    >>> pm.save_rig("office", pm.load_demo("office"))
    >>> [frame.name for frame in pm.load_rig("office").frames]
    ['node_00', 'node_01', 'node_02']
    """
    directory = Path(directory)
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
    frames = tuple(_load_node(folder) for folder in folders)
    return Rig(directory.resolve().name, frames, read_truth(directory, frames))


def save_rig(directory: AnyPath, rig: Rig) -> None:
    """Write every frame of ``rig`` as ``directory/node_NN``; with its truth beside them, if it has one.

    Raises:
        InputError: the folder cannot be written, or holds nodes of a larger rig.

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
    for name, frame in zip(names, rig.frames, strict=True):
        folder = directory / name
        write_color(folder / "color.png", frame.rgb)
        write_depth_mm(folder / "depth.png", frame.depth)
        write_intrinsics(folder / "intrinsics.json", frame.intrinsics)
        write_pose(folder / "pose.txt", frame.T_world_camera)
    if rig.truth is not None:
        write_truth(directory, names, rig.truth)


def _node_folders(directory: Path) -> list[Path]:
    return sorted(folder for folder in directory.glob("node_*") if folder.is_dir())


def _load_node(folder: Path) -> RgbdFrame:
    frame = load_frame(
        folder / "color.png", folder / "depth.png", folder / "intrinsics.json", name=folder.name
    )
    pose = folder / "pose.txt"
    if not pose.exists():
        return frame
    return RgbdFrame(frame.name, frame.rgb, frame.depth, frame.intrinsics, read_pose(pose))
