"""A rig folder, all of it or nothing."""

from __future__ import annotations

import secrets
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from packetmesh.errors import InputError
from pipeline.io.calibrations import FILES
from pipeline.io.extrinsics import write_extrinsics
from pipeline.io.images import write_color, write_depth_mm
from pipeline.io.intrinsics import write_intrinsics
from pipeline.io.poses import write_pose
from pipeline.types import ByteArray, CameraIntrinsics, DepthMap, FloatArray


@dataclass(frozen=True, slots=True)
class NodeImages:
    """What one node's folder gets."""

    color_name: str
    """The file or topic that the colour image is of."""
    depth_name: str
    rgb: ByteArray
    """(H, W, 3)."""
    depth: DepthMap
    """(H, W), or (h, w) of the depth camera."""
    camera: CameraIntrinsics
    T_world_camera: FloatArray | None
    """(4, 4), metres, if it is known."""
    depth_camera: CameraIntrinsics | None = None
    """Of depth that is not registered to the colour image."""
    T_color_depth: FloatArray | None = None
    """(4, 4) where that camera stands, metres; with a depth camera."""
    notes: tuple[str, ...] = ()
    """What is doubtful about its depth, a sentence each."""


@contextmanager
def new_folder(out: Path) -> Iterator[Path]:
    """A sibling that becomes ``out`` if the body succeeds and vanishes if not."""
    sibling = out.with_name(f".{out.name}-{secrets.token_hex(4)}")
    try:
        sibling.mkdir(parents=True)
        yield sibling
        if out.is_dir():
            out.rmdir()
        sibling.rename(out)
    except OSError as error:
        raise InputError(
            f"{out} cannot be written ({error.strerror or error}); try another folder for the rig"
        ) from None
    finally:
        shutil.rmtree(sibling, ignore_errors=True)


def write_node(folder: Path, node: NodeImages) -> None:
    """Write ``folder``/{color.png, depth.png, intrinsics.json} and what else is known.

    Raises:
        InputError: images and cameras of different sizes, or a folder that cannot be written.
    """
    _check_size("intrinsics", (node.camera.height_px, node.camera.width_px), node.color_name, node.rgb.shape)
    if node.depth_camera is None or node.T_color_depth is None:
        _check_size(f"depth {node.depth_name}", node.depth.z_m.shape, node.color_name, node.rgb.shape)
    else:
        shape = (node.depth_camera.height_px, node.depth_camera.width_px)
        _check_size("depth camera's intrinsics", shape, node.depth_name, node.depth.z_m.shape)
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
            "try a recording whose depth is registered to the colour images"
        )
