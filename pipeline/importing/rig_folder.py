"""Writing of a rig folder, completely or not at all."""

from __future__ import annotations

import re
import secrets
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from packetmesh.errors import InputError
from packetmesh.files import remedy
from pipeline.io.calibrations import FILES
from pipeline.io.extrinsics import write_extrinsics
from pipeline.io.images import write_color, write_depth_mm
from pipeline.io.intrinsics import write_intrinsics
from pipeline.io.poses import write_pose
from pipeline.types import ByteArray, CameraIntrinsics, DepthMap, FloatArray


@dataclass(frozen=True, slots=True)
class NodeImages:
    """Contents of one node's folder."""

    color_name: str
    """File or topic of the colour image."""
    depth_name: str
    rgb: ByteArray
    """(H, W, 3) RGB."""
    depth: DepthMap
    """(H, W), or (h, w) of a separate depth camera."""
    camera: CameraIntrinsics
    T_world_camera: FloatArray | None
    """(4, 4) pose, metres; None if it is unknown."""
    depth_camera: CameraIntrinsics | None = None
    """Depth camera, if the depth is not registered to the colour image."""
    T_color_depth: FloatArray | None = None
    """(4, 4) pose of the depth camera in the colour camera's frame, metres; given with ``depth_camera``."""
    notes: tuple[str, ...] = ()
    """Doubts about its depth, one sentence each."""


def check_new(out: Path) -> None:
    """Raise an InputError for a folder that is neither new nor empty; what killed imports left is ignored."""
    if out.is_dir():
        if len(list(out.iterdir())) > len(_unfinished(out, out.resolve().name)):
            raise InputError(f"The folder {out} is not empty; try another name")
    elif out.exists():
        raise InputError(f"{out} exists already; try another name")


def _unfinished(folder: Path, name: str) -> list[Path]:
    """Return the hidden folders in a folder that ``new_folder`` left when it was killed."""
    hidden = re.compile(rf"\.{re.escape(name)}-[0-9a-f]{{8}}")
    return [path for path in folder.glob(".*") if hidden.fullmatch(path.name)]


@contextmanager
def new_folder(out: Path) -> Iterator[Path]:
    """Create a hidden folder; its contents are moved to ``out`` if the body succeeds, and deleted otherwise.

    Hidden folders of killed imports are deleted. An empty folder ``out`` stays the same folder: it may be the
    working folder of this process.

    Raises:
        InputError: a folder or a file in it cannot be written.
    """
    out = out.resolve()
    exists = out.is_dir()
    hidden = (out if exists else out.parent) / f".{out.name}-{secrets.token_hex(4)}"
    try:
        for left in _unfinished(hidden.parent, out.name):
            shutil.rmtree(left)
        hidden.mkdir(parents=True)
        yield hidden
        if exists:
            for path in sorted(hidden.iterdir()):
                path.rename(out / path.name)
        else:
            hidden.rename(out)
    except InputError as error:
        raise InputError(str(error).replace(str(hidden), str(out))) from None
    except OSError as error:
        raise InputError(f"{out} cannot be written ({error.strerror or error}); {remedy(error)}") from None
    finally:
        shutil.rmtree(hidden, ignore_errors=True)


def write_node(folder: Path, node: NodeImages) -> None:
    """Write ``folder``/{color.png, depth.png, intrinsics.json}, and pose and depth camera if known.

    Raises:
        InputError: images and cameras differ in size, or the folder cannot be written.
    """
    _check_size("camera", (node.camera.height_px, node.camera.width_px), node.color_name, node.rgb.shape)
    if node.depth_camera is None or node.T_color_depth is None:
        _check_size(f"depth {node.depth_name}", node.depth.z_m.shape, node.color_name, node.rgb.shape)
    else:
        shape = (node.depth_camera.height_px, node.depth_camera.width_px)
        _check_size("depth camera", shape, node.depth_name, node.depth.z_m.shape)
        write_intrinsics(folder / FILES["depth_intrinsics"], node.depth_camera)
        write_extrinsics(folder / FILES["extrinsics"], node.T_color_depth)
    write_color(folder / "color.png", node.rgb)
    write_depth_mm(folder / "depth.png", node.depth)
    write_intrinsics(folder / "intrinsics.json", node.camera)
    if node.T_world_camera is not None:
        write_pose(folder / "pose.txt", node.T_world_camera)


def _check_size(what: str, shape: tuple[int, ...], of_what: str, of_shape: tuple[int, ...]) -> None:
    if shape != of_shape[:2]:
        raise InputError(
            f"The {what} has {shape[1]} x {shape[0]} pixels but {of_what} has {of_shape[1]} x {of_shape[0]}; "
            "try a recording whose images all have the size of their camera"
        )
