"""COLMAP's models: cameras, images and points of text files; ``colmap_binary`` reads the binary ones.

https://colmap.github.io/format.html.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from packetmesh.errors import InputError
from packetmesh.files import MAX_GEOMETRY_BYTES, read_bytes, text_in
from pipeline.io.lenses import FISHEYE, lens_of
from pipeline.kernels.geometry import rigid
from pipeline.types import CameraIntrinsics, FloatArray

CENTRE_PX = 0.5
"""Coordinate of the first pixel's centre in COLMAP; here it is 0 (SPEC 1.1)."""
PARAMETERS = {
    "SIMPLE_PINHOLE": ("fx", "cx", "cy"),
    "PINHOLE": ("fx", "fy", "cx", "cy"),
    "SIMPLE_RADIAL": ("fx", "cx", "cy", "k1"),
    "RADIAL": ("fx", "cx", "cy", "k1", "k2"),
    "OPENCV": ("fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2"),
    "FULL_OPENCV": ("fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"),
    "SIMPLE_RADIAL_FISHEYE": ("fx", "cx", "cy", "k1"),
    "RADIAL_FISHEYE": ("fx", "cx", "cy", "k1", "k2"),
    "OPENCV_FISHEYE": ("fx", "fy", "cx", "cy", "k1", "k2", "k3", "k4"),
    "SIMPLE_FISHEYE": ("fx", "cx", "cy"),
    "FISHEYE": ("fx", "fy", "cx", "cy"),
}
"""Parameters of the supported camera models."""
_DISTORTION = ("k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6")
_FISHEYE_DISTORTION = ("k1", "k2", "k3", "k4")


@dataclass(frozen=True, slots=True)
class ModelImage:
    """A registered image."""

    camera: int
    name: str
    T_camera_model: FloatArray
    """(4, 4), in the model's unit."""
    features: Callable[[], FloatArray]
    """Returns (N, 3) column and row, COLMAP's pixels, and id of the point of each feature; -1 is no point."""


@dataclass(frozen=True, slots=True)
class Model:
    """A sparse model."""

    files: dict[str, Path]
    """Files by what they hold: cameras, images and points3D."""
    cameras: dict[int, CameraIntrinsics]
    """Cameras with supported models, by id."""
    others: dict[int, str]
    """Names of the other cameras' models, by id."""
    images: list[ModelImage]
    points: Callable[[], dict[int, FloatArray]]
    """Returns (3,) positions of the points by id, in the model's unit."""


def files_of(folder: Path, suffix: str) -> dict[str, Path]:
    """Return the paths of a model's files, which need not exist, by what they hold."""
    return {name: folder / f"{name}{suffix}" for name in ("cameras", "images", "points3D")}


def read_text_model(folder: Path) -> Model:
    """Read cameras.txt and images.txt; points3D.txt is read when it is requested.

    Raises:
        InputError: a file is damaged.
    """
    files = files_of(folder, ".txt")
    cameras, others = _cameras(files["cameras"])
    images = list(_images(files["images"]))
    return Model(files, cameras, others, images, partial(_points, files["points3D"]))


def camera_of_model(name: str, width_px: int, height_px: int, values: FloatArray) -> CameraIntrinsics:
    """Return a camera from the parameters of its model, which is one of ``PARAMETERS``."""
    given = dict(zip(PARAMETERS[name], values.tolist(), strict=True))
    fx, fy = given["fx"], given.get("fy", given["fx"])
    pinhole = CameraIntrinsics.pinhole(
        fx, fy, given["cx"] - CENTRE_PX, given["cy"] - CENTRE_PX, width_px, height_px
    )
    fisheye = name.endswith("FISHEYE")
    lens = [given.get(key, 0.0) for key in (_FISHEYE_DISTORTION if fisheye else _DISTORTION)]
    distortion = lens_of(FISHEYE if fisheye else "", np.array(lens))
    assert distortion is not None  # all models of PARAMETERS are supported
    return replace(pinhole, distortion=distortion, fisheye=fisheye)


def pose_of(file: Path, name: str, quaternion: FloatArray, position: FloatArray) -> FloatArray:
    """Return the (4, 4) transform of a quaternion, its scalar first, and a position.

    Raises:
        InputError: the quaternion is no rotation.
    """
    if np.linalg.norm(quaternion) < 0.5:
        raise InputError(f"{file} has no rotation for {name}; check the file")
    return rigid(Rotation.from_quat(np.roll(quaternion, -1)).as_matrix(), position)


def _cameras(file: Path) -> tuple[dict[int, CameraIntrinsics], dict[int, str]]:
    """Read the cameras with supported models, and the names of the other models, by their ids."""
    cameras, others = dict[int, CameraIntrinsics](), dict[int, str]()
    for line in _lines(file):
        words = line.split()
        names = PARAMETERS.get(words[1] if len(words) > 1 else "")
        if names is None:
            if len(words) > 1 and words[0].isdigit():
                others[int(words[0])] = words[1]
            continue
        (row,) = _numbers([words[0], *words[2:]], 3 + len(names), file)
        cameras[int(row[0])] = camera_of_model(words[1], int(row[1]), int(row[2]), row[3:])
    if not cameras and not others:
        raise InputError(f"{file} has no line of a camera; try to export the model again")
    return cameras, others


def _images(file: Path) -> Iterator[ModelImage]:
    """Yield the images: each has two lines, of which the second may be empty."""
    lines = [line for line in _text(file).splitlines() if not line.startswith("#")]
    for line, points in zip(lines[::2], [*lines[1::2], ""], strict=False):
        words = line.split(maxsplit=9)
        if len(words) < 10:
            raise InputError(f"{file} has the line '{line[:80]}' where an image is expected; check the file")
        (row,) = _numbers(words[:9], 9, file)
        T = pose_of(file, words[9], row[1:5], row[5:8])
        yield ModelImage(int(row[8]), words[9].strip(), T, partial(_features, points, file))


def _features(line: str, file: Path) -> FloatArray:
    return _numbers(line.split(), 3, file)


def _points(file: Path) -> dict[int, FloatArray]:
    """Read (3,) positions of the points by their ids, in the model's unit."""
    rows = [line.split(maxsplit=4)[:4] for line in _lines(file)]
    values = _numbers([word for row in rows for word in row], 4, file)
    return {int(row[0]): row[1:] for row in values}


def _lines(file: Path) -> Iterator[str]:
    return (line for line in _text(file).splitlines() if line.strip() and not line.startswith("#"))


def _text(file: Path) -> str:
    return text_in(read_bytes(file, MAX_GEOMETRY_BYTES, "part of a COLMAP model"), "replace")


def _numbers(words: list[str], columns: int, file: Path) -> FloatArray:
    """Convert words to (N, columns) numbers."""
    try:
        values = np.array(words, dtype=np.float64).reshape(-1, columns)
    except ValueError:
        raise InputError(
            f"{file} has words or too few numbers where numbers belong; check the file"
        ) from None
    if not np.isfinite(values).all():
        raise InputError(f"{file} has numbers that are not finite; check the file")
    return values
