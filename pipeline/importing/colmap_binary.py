"""COLMAP's binary models: cameras.bin, images.bin and points3D.bin, little-endian.

https://colmap.github.io/format.html. Newer models also have rigs.bin and frames.bin, which repeat the poses.
"""

from __future__ import annotations

import struct
from functools import partial
from pathlib import Path

import numpy as np

from packetmesh.errors import InputError
from packetmesh.files import MAX_GEOMETRY_BYTES, read_bytes
from pipeline.importing.colmap_model import (
    PARAMETERS,
    Model,
    ModelImage,
    camera_of_model,
    files_of,
    pose_of,
)
from pipeline.types import CameraIntrinsics, FloatArray

_MODELS = (
    ("SIMPLE_PINHOLE", 3),
    ("PINHOLE", 4),
    ("SIMPLE_RADIAL", 4),
    ("RADIAL", 5),
    ("OPENCV", 8),
    ("OPENCV_FISHEYE", 8),
    ("FULL_OPENCV", 12),
    ("FOV", 5),
    ("SIMPLE_RADIAL_FISHEYE", 4),
    ("RADIAL_FISHEYE", 5),
    ("THIN_PRISM_FISHEYE", 12),
    ("RAD_TAN_THIN_PRISM_FISHEYE", 16),
    ("SIMPLE_DIVISION", 4),
    ("DIVISION", 5),
    ("SIMPLE_FISHEYE", 3),
    ("FISHEYE", 4),
    ("EUCM", 6),
    ("EQUIRECTANGULAR", 2),
)
"""Names and numbers of parameters of the camera models, in the order of their ids."""
_CAMERA = struct.Struct("<IiQQ")
_IMAGE = struct.Struct("<I7dI")
_FEATURE = np.dtype([("x", "<f8"), ("y", "<f8"), ("point", "<i8")])
_POINT = struct.Struct("<Q3d3BdQ")
_TRACK_BYTES = 8
"""Bytes of one entry in the list of images that see a point."""


class _File:
    """A binary file that is read from front to back."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.data = read_bytes(path, MAX_GEOMETRY_BYTES, "part of a COLMAP model")
        self.at = 0

    def values(self, form: struct.Struct) -> tuple:
        """Read the values of a record."""
        self.skip(form.size)
        return form.unpack_from(self.data, self.at - form.size)

    def count(self) -> int:
        """Read the number of records that follow."""
        (count,) = self.values(struct.Struct("<Q"))
        return int(count)

    def skip(self, size_bytes: int) -> None:
        if size_bytes > len(self.data) - self.at:
            raise self.damaged()
        self.at += size_bytes

    def damaged(self) -> InputError:
        return InputError(f"{self.path} is truncated or damaged; try to copy or export the model again")


def read_binary_model(folder: Path) -> Model:
    """Read cameras.bin and images.bin; points3D.bin is read when it is requested.

    Raises:
        InputError: a file is damaged.
    """
    files = files_of(folder, ".bin")
    cameras, others = _cameras(files["cameras"])
    images = _images(files["images"])
    return Model(files, cameras, others, images, partial(_points, files["points3D"]))


def _cameras(path: Path) -> tuple[dict[int, CameraIntrinsics], dict[int, str]]:
    """Read the cameras with supported models, and the names of the other models, by their ids."""
    file = _File(path)
    cameras, others = dict[int, CameraIntrinsics](), dict[int, str]()
    for _ in range(file.count()):
        number, model, width_px, height_px = file.values(_CAMERA)
        if not 0 <= model < len(_MODELS):
            raise InputError(
                f"Camera {number} of {path} has the unknown model {model}; try colmap model_converter "
                "--output_type TXT"
            )
        name, count = _MODELS[model]
        start = file.at
        file.skip(8 * count)
        if name not in PARAMETERS:
            others[number] = name
            continue
        values = np.frombuffer(file.data, "<f8", count, start)
        if not np.isfinite(values).all():
            raise file.damaged()
        cameras[number] = camera_of_model(name, width_px, height_px, values)
    if not cameras and not others:
        raise InputError(f"{path} has no camera; try to export the model again")
    return cameras, others


def _images(path: Path) -> list[ModelImage]:
    file = _File(path)
    images = []
    for _ in range(file.count()):
        _, *pose, camera = file.values(_IMAGE)
        end = file.data.find(b"\0", file.at)
        if end < 0 or not np.isfinite(pose).all():
            raise file.damaged()
        name = file.data[file.at : end].decode("utf-8", "replace")
        file.skip(end + 1 - file.at)
        count = file.count()
        start = file.at
        file.skip(count * _FEATURE.itemsize)
        T = pose_of(path, name, np.array(pose[:4]), np.array(pose[4:]))
        images.append(ModelImage(camera, name, T, partial(_features, file.data, count, start)))
    return images


def _features(data: bytes, count: int, start: int) -> FloatArray:
    rows = np.frombuffer(data, _FEATURE, count, start)
    return np.stack([rows["x"], rows["y"], rows["point"]], axis=1)


def _points(path: Path) -> dict[int, FloatArray]:
    """Read (3,) positions of the points by their ids, in the model's unit."""
    file = _File(path)
    points = {}
    for _ in range(file.count()):
        number, x, y, z, _, _, _, _, seen = file.values(_POINT)
        file.skip(_TRACK_BYTES * seen)
        points[number] = np.array([x, y, z])
    return points
