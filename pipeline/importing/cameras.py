"""Camera of a recording, from a file next to the images or from the data set's documentation."""

from __future__ import annotations

import re
from collections.abc import Iterable
from pathlib import Path

from packetmesh.errors import InputError
from pipeline.importing.stored import AnyImage, read_color_of
from pipeline.io.intrinsics import read_intrinsics
from pipeline.io.same_view import alike
from pipeline.types import CameraIntrinsics

PRIMESENSE = CameraIntrinsics.pinhole(525.0, 525.0, 319.5, 239.5, 640, 480)
"""Factory intrinsics of a Kinect or Asus Xtion, which ROS and Open3D also assume."""


_SUFFIXES = ("json", "yaml", "yml")
_NAMED = ("*intrinsic*.txt", "camera_matrix.csv")
"""Files that contain a camera by their names; those of ``_SUFFIXES`` may contain other things."""
_FOLDERS = ("calib", "calibration", "intrinsics")
"""Subfolders of camera files, as RTAB-Map exports them."""
_OTHER_CAMERA = re.compile(r"(?<![a-z])(depth|ir|infra\d?|infrared)(?![a-z])", re.IGNORECASE)
"""Part of the name of a depth camera's file, such as depth_intrinsics.json."""


def camera_of(
    folder: Path, color: AnyImage, given: Path | None, default: CameraIntrinsics | None, default_name: str
) -> tuple[CameraIntrinsics, tuple[str, ...]]:
    """Return the camera of a recording, and a note if it had to be assumed.

    Args:
        folder: folder of the recording. These are tried in it and its ``_FOLDERS``: JSON and YAML files for
            images of this size, then \\*intrinsic\\*.txt and camera_matrix.csv, then other JSON and YAML
            files; then \\*intrinsic\\*.txt in the folder above.
        color: one of the colour images.
        given: intrinsics file given by the user, which is preferred.
        default: camera to assume if there is no such file; None raises an error then.
        default_name: description of the default, for the note.

    Raises:
        InputError: no camera is found, files have different ones, or it is for images of another size.
    """
    height_px, width_px = read_color_of(color).shape[:2]
    size_px = width_px, height_px
    found, others = (given, []) if given else _file_in(folder, size_px)
    if found is not None:
        camera = read_intrinsics(found, size_px)
        if (camera.width_px, camera.height_px) != size_px:
            raise InputError(
                f"The intrinsics file {found} is for {camera.width_px} x {camera.height_px} pixels but "
                f"{color.name} has {width_px} x {height_px}; try --intrinsics FILE with those of these images"
            )
        return camera, ()
    none = f"no intrinsics that can be read{f' ({others[0]} holds none)' if others else ''}"
    if default is None:
        raise InputError(f"{folder} has {none}; try --intrinsics FILE")
    if (default.width_px, default.height_px) != size_px:
        raise InputError(
            f"{folder} has {none}, and {color.name} has {width_px} x {height_px} pixels, not the "
            f"{default.width_px} x {default.height_px} of the camera that would be assumed ({default_name}); "
            "try --intrinsics FILE"
        )
    return default, (f"{none[0].upper()}{none[1:]}: taken as {default_name}; --intrinsics names others",)


def _file_in(folder: Path, size_px: tuple[int, int]) -> tuple[Path | None, list[str]]:
    """Return the intrinsics file of a recording, or None, and the names of files without a camera.

    Raises:
        InputError: several files hold different cameras for images of this size.
    """
    others, of_other_sizes = list[str](), list[Path]()
    fitting: dict[Path, CameraIntrinsics] = {}
    for path in [path for suffix in _SUFFIXES for path in _files(folder, f"*.{suffix}")]:
        try:
            camera = read_intrinsics(path, size_px)
        except InputError:  # JSON or YAML of another kind
            others.append(path.name)
            continue
        if (camera.width_px, camera.height_px) == size_px:
            fitting[path] = camera
        else:
            of_other_sizes.append(path)
    if fitting:
        return _only(folder, fitting), []
    named = [path for pattern in _NAMED for path in _files(folder, pattern)]
    above = sorted(folder.parent.glob(_NAMED[0]))
    found = _of_color([*named, *of_other_sizes, *above])
    return next(iter(found), None), others


def _files(folder: Path, pattern: str) -> list[Path]:
    return [
        path
        for place in (folder, *(folder / name for name in _FOLDERS))
        for path in sorted(place.glob(pattern))
    ]


def _of_color(paths: Iterable[Path]) -> list[Path]:
    """Return the paths whose names are not of a depth or infrared camera, or all if there are no others."""
    paths = list(paths)
    return [path for path in paths if not _OTHER_CAMERA.search(path.stem)] or paths


def _only(folder: Path, fitting: dict[Path, CameraIntrinsics]) -> Path:
    """Return the file of the colour camera.

    Raises:
        InputError: several files hold different cameras.
    """
    paths = _of_color(fitting)
    first = fitting[paths[0]]
    if any(not alike(fitting[path], first) for path in paths[1:]):
        names = ", ".join(path.relative_to(folder).as_posix() for path in paths[:4])
        raise InputError(
            f"{folder} has different cameras for images of this size in {names}; try --intrinsics FILE with "
            "that of the colour images"
        )
    return paths[0]
