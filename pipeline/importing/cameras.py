"""Camera of a recording, from a file next to the images or from the data set's documentation."""

from __future__ import annotations

from pathlib import Path

from packetmesh.errors import InputError
from pipeline.io.images import read_color
from pipeline.io.intrinsics import read_intrinsics
from pipeline.types import CameraIntrinsics

PRIMESENSE = CameraIntrinsics.pinhole(525.0, 525.0, 319.5, 239.5, 640, 480)
"""Factory intrinsics of a Kinect or Asus Xtion, which ROS and Open3D also assume."""


def camera_of(
    folder: Path, color: Path, given: Path | None, default: CameraIntrinsics | None, default_name: str
) -> tuple[CameraIntrinsics, tuple[str, ...]]:
    """Return the camera of a recording, and a note if it had to be assumed.

    Args:
        folder: folder of the recording; JSON files in it, then \\*intrinsic\\*.txt in it and above are tried.
        color: one of the colour images.
        given: intrinsics file given by the user, which is preferred.
        default: camera to assume if there is no such file.
        default_name: description of the default, for the note.

    Raises:
        InputError: no camera is found, or it is for images of another size.
    """
    height_px, width_px = read_color(color).shape[:2]
    size_px = width_px, height_px
    camera = _in_files(folder, size_px) if given is None else read_intrinsics(given, size_px)
    notes: tuple[str, ...] = ()
    if camera is None:
        if default is None:
            raise InputError(f"{folder} has no file with the camera's intrinsics; try --intrinsics FILE")
        camera = default
        notes = (f"No intrinsics beside the images: taken as {default_name}; --intrinsics names others",)
    if (camera.width_px, camera.height_px) != (width_px, height_px):
        raise InputError(
            f"The intrinsics of {folder} are for {camera.width_px} x {camera.height_px} pixels but "
            f"{color.name} has {width_px} x {height_px}; try --intrinsics FILE with those of these images"
        )
    return camera, notes


def _in_files(folder: Path, size_px: tuple[int, int]) -> CameraIntrinsics | None:
    for path in sorted(folder.glob("*.json")):
        try:
            return read_intrinsics(path)
        except InputError:  # JSON of another kind
            continue
    for path in [*sorted(folder.glob("*intrinsic*.txt")), *sorted(folder.parent.glob("*intrinsic*.txt"))]:
        return read_intrinsics(path, size_px)
    return None
