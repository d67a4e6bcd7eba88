"""The camera of a recording: a file beside the images, or what the data set is known to have used."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from packetmesh.errors import InputError
from packetmesh.files import read_text
from pipeline.io.images import read_color
from pipeline.io.intrinsics import read_intrinsics
from pipeline.types import CameraIntrinsics, FloatArray

PRIMESENSE = CameraIntrinsics.pinhole(525.0, 525.0, 319.5, 239.5, 640, 480)
"""The factory's numbers for a Kinect or an Asus Xtion, which ROS and Open3D assume, too."""


def camera_of(
    folder: Path, color: Path, given: Path | None, default: CameraIntrinsics | None, default_name: str
) -> tuple[CameraIntrinsics, tuple[str, ...]]:
    """The camera of a recording and a note if it had to be assumed.

    Args:
        folder: of the recording; its JSON files, then its and its parent's \\*intrinsic\\*.txt are looked at.
        color: one of the colour images.
        given: intrinsics that the person names, which come first.
        default: if there is no such file.
        default_name: whose that is, for the note.

    Raises:
        InputError: none of these gives a camera, or it is for images of another size.
    """
    camera = _in_files(folder, color) if given is None else read_intrinsics(given)
    notes: tuple[str, ...] = ()
    if camera is None:
        if default is None:
            raise InputError(f"{folder} has no file with the camera's intrinsics; try --intrinsics FILE")
        camera = default
        notes = (f"No intrinsics beside the images: taken as {default_name}; --intrinsics names others",)
    height_px, width_px = read_color(color).shape[:2]
    if (camera.width_px, camera.height_px) != (width_px, height_px):
        raise InputError(
            f"The intrinsics of {folder} are for {camera.width_px} x {camera.height_px} pixels but "
            f"{color.name} has {width_px} x {height_px}; try --intrinsics FILE with those of these images"
        )
    return camera, notes


def _in_files(folder: Path, color: Path) -> CameraIntrinsics | None:
    for path in sorted(folder.glob("*.json")):
        try:
            return read_intrinsics(path)
        except InputError:  # JSON of something else
            continue
    for path in [*sorted(folder.glob("*intrinsic*.txt")), *sorted(folder.parent.glob("*intrinsic*.txt"))]:
        height_px, width_px = read_color(color).shape[:2]
        return camera_in_matrix(path, width_px, height_px)
    return None


def camera_in_matrix(path: Path, width_px: int, height_px: int) -> CameraIntrinsics:
    """Of a text file with a 3 x 3 or 4 x 4 camera matrix, in rows or in one line.

    Raises:
        InputError: it does not hold such a matrix.
    """
    matrix = numbers_in(path, "intrinsics file")
    if matrix.size not in (9, 16):
        raise InputError(f"The intrinsics file {path} holds no matrix; try three lines of three numbers")
    side = 3 if matrix.size == 9 else 4
    matrix = matrix.reshape(side, side)[:3, :3]
    if not (np.isfinite(matrix).all() and matrix[0, 0] > 0 and matrix[1, 1] > 0 and matrix[2, 2] == 1):
        raise InputError(
            f"The intrinsics file {path} holds no camera matrix; try fx 0 cx, 0 fy cy, 0 0 1 in pixels"
        )
    fx, fy, cx, cy = matrix[[0, 1, 0, 1], [0, 1, 2, 2]].tolist()
    return CameraIntrinsics.pinhole(fx, fy, cx, cy, width_px, height_px)


def numbers_in(path: Path, what: str) -> FloatArray:
    """(N,) all numbers of a text file.

    Raises:
        InputError: it cannot be read or holds other things than numbers.
    """
    try:
        return np.array(read_text(path, what).replace(",", " ").split(), dtype=np.float64)
    except ValueError:
        raise InputError(f"The {what} {path} holds other things than numbers; check the file") from None
