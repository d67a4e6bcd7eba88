"""Import of nerfstudio's and instant-ngp's transforms.json with depth images.

https://docs.nerf.studio/quickstart/data_conventions.html
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from packetmesh.errors import InputError
from packetmesh.files import MAX_TEXT_BYTES, json_object, read_text
from pipeline.importing.cameras import camera_of
from pipeline.importing.found_poses import found_poses
from pipeline.importing.sequence import Candidate, Sequence, existing, named_inside, posed
from pipeline.io.intrinsics import camera_of_values
from pipeline.types import CameraIntrinsics, FloatArray

_FILE = "transforms.json"
_DEPTHS = ("depth_file_path", "depth_path")
_CAMERA = (
    *("camera_model", "is_fisheye", "fl_x", "fl_y", "cx", "cy", "w", "h"),
    *("k1", "k2", "p1", "p2", "k3", "k4"),
)
"""Keys of a camera in the file or in one of its frames."""
_Y_DOWN = np.diag([1.0, -1.0, -1.0, 1.0])
"""(4, 4) transform from camera axes with z forward, y down to OpenGL's, with z backward and y up."""


def is_nerfstudio(folder: Path) -> bool:
    """Return whether a folder contains transforms.json that names the depth image of a frame."""
    try:
        return bool(_frames(folder)[1])
    except InputError:
        return False


def read_nerfstudio(folder: Path, intrinsics: Path | None) -> Sequence:
    """Read the frames with depth, in millimetres; their poses are taken to be in metres.

    Raises:
        InputError: no frame's images exist, or no camera is known.
    """
    values, frames = _frames(folder)
    poses = found_poses({k: T for k, own in enumerate(frames) if (T := _pose(own)) is not None})
    named, missing = existing(
        [
            Candidate(
                named_inside(folder, str(own.get("file_path")), _FILE),
                named_inside(folder, str(_depth(own)), _FILE),
                poses.T_world_camera.get(k),
                camera=None if intrinsics else _camera(folder, values, own),
            )
            for k, own in enumerate(frames)
        ],
        str(folder / _FILE),
        "try to unpack the images next to it",
    )
    candidates, without, notes = posed(named, f"transform_matrix in {_FILE}", poses)
    if poses.T_world_camera:
        notes += (f"The poses of {_FILE} are taken to be in metres",)
    camera = candidates[0].camera
    if camera is None:
        camera, assumed = camera_of(folder, candidates[0].color, intrinsics, None, "")
        notes += assumed
    return Sequence(candidates, camera, without_poses=without, notes=(*missing, *notes))


def _frames(folder: Path) -> tuple[dict[str, Any], list[dict[str, Any]]]:
    """Read transforms.json; returns its values and the frames that have a depth image.

    Raises:
        InputError: the file does not exist or is no JSON.
    """
    file = folder / _FILE
    values = json_object(read_text(file, "transforms", 100 * MAX_TEXT_BYTES), file, "transforms")
    frames = values.get("frames")
    every = frames if isinstance(frames, list) else []
    return values, [own for own in every if isinstance(own, dict) and _depth(own) and own.get("file_path")]


def _depth(frame: Mapping[str, Any]) -> str | None:
    return next((str(frame[key]) for key in _DEPTHS if frame.get(key)), None)


def _pose(frame: Mapping[str, Any]) -> FloatArray | None:
    """Return the (4, 4) T_world_camera of a frame; None if it has none."""
    try:
        T = np.array(frame.get("transform_matrix"), dtype=np.float64)
    except (TypeError, ValueError):
        return None
    return T @ _Y_DOWN if T.shape == (4, 4) else None


def _camera(folder: Path, values: Mapping[str, Any], frame: Mapping[str, Any]) -> CameraIntrinsics:
    """Return the camera of a frame; its own keys replace those of the file.

    Raises:
        InputError: there is no camera, or it has impossible values.
    """
    of = {key: own[key] for own in (values, frame) for key in _CAMERA if key in own}
    if "fl_x" not in of:
        raise InputError(
            f"{folder / _FILE} has no camera that can be read, such as fl_x; try --intrinsics FILE"
        )
    return camera_of_values(folder / _FILE, of, str(of), None)
