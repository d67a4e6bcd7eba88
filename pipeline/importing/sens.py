"""Import of ScanNet's .sens files: all frames of a scan with cameras and poses in one file.

Dai et al., "ScanNet", CVPR 2017; the layout is that of SensReader, https://github.com/ScanNet/ScanNet.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from itertools import pairwise
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from packetmesh.errors import InputError
from packetmesh.files import MAX_IMAGE_BYTES, MAX_IMAGE_PIXELS
from pipeline.importing.cameras import camera_of
from pipeline.importing.found_poses import found_poses
from pipeline.importing.sequence import Candidate, Sequence, posed
from pipeline.importing.stored import StoredImage
from pipeline.io.images import color_in
from pipeline.io.intrinsics import check_camera
from pipeline.io.poses import nearest_rigid
from pipeline.io.same_view import alike
from pipeline.kernels.geometry import inverse
from pipeline.types import ByteArray, CameraIntrinsics, FloatArray

_VERSION = 4
_LONGEST_NAME = 10_000
_FRAME = struct.Struct("<16f4Q")
"""Pose, times of colour and depth in microseconds, sizes of colour and depth in bytes."""
_RAW_COLOR, _COLORS = 0, (0, 1, 2)
"""Compressions of colour: none, PNG and JPEG."""
_RAW_DEPTH, _ZLIB, _OCCIPITAL = 0, 1, 2


@dataclass(frozen=True, slots=True)
class _Header:
    """The header of a file."""

    cameras: tuple[CameraIntrinsics, CameraIntrinsics]
    """Cameras of colour and depth."""
    T_color_depth: FloatArray
    color_compression: int
    depth_compression: int
    units_per_metre: float
    frames: int
    """Number of frames that follow."""


@dataclass(frozen=True, slots=True)
class _Frame:
    """Pose and time of a frame, and the place of its images in the file."""

    pose: FloatArray
    """(4, 4) T_world_camera, metres; infinite where tracking was lost."""
    time_us: int
    color_at: tuple[int, int]
    """First byte and number of bytes."""
    depth_at: tuple[int, int]


def read_sens(file: Path, intrinsics: Path | None) -> Sequence:
    """Read the frames of a .sens file; their images are read when they are requested.

    Raises:
        InputError: the file has another form or compression, or no complete frame.
    """
    try:
        with file.open("rb") as opened:
            header = _header(opened, file)
            every = list(_frames(opened, header.frames, file.stat().st_size))
    except OSError as error:
        raise InputError(f"{file} cannot be read ({error.strerror}); try another file") from None
    if not every:
        raise InputError(f"{file} is cut before the end of its first frame; try to copy it again")
    cut = f"{file} is cut: it has {len(every)} of its {header.frames} frames; try to copy it again"
    timed = all(before.time_us < after.time_us for before, after in pairwise(every))
    poses = found_poses({k: frame.pose for k, frame in enumerate(every)})
    candidates, without, notes = posed(
        [
            Candidate(
                StoredImage(file, f"colour image {k}", partial(_color, file, k, frame, header)),
                StoredImage(file, f"depth image {k}", partial(_depth, file, k, frame, header)),
                poses.T_world_camera.get(k),
                1e-6 * frame.time_us if timed else None,
            )
            for k, frame in enumerate(every)
        ],
        "pose of its frames",
        poses,
    )
    color, depth = header.cameras
    if intrinsics:
        color, _ = camera_of(file.parent, candidates[0].color, intrinsics, None, "")
    own_depth = not (alike(color, depth) and np.allclose(header.T_color_depth, np.eye(4), atol=1e-6))
    return Sequence(
        candidates,
        color,
        header.units_per_metre,
        depth_camera=depth if own_depth else None,
        T_color_depth=header.T_color_depth if own_depth else None,
        without_poses=without,
        notes=(*((cut,) if len(every) < header.frames else ()), *notes),
    )


def _header(opened: BinaryIO, file: Path) -> _Header:
    damaged = InputError(
        f"{file} does not begin as a .sens file of ScanNet (version {_VERSION}); try to copy it again"
    )
    try:
        version, length = struct.unpack("<IQ", opened.read(12))
        if version != _VERSION or length > _LONGEST_NAME:
            raise damaged
        opened.read(length)
        matrices = np.array(struct.unpack("<64f", opened.read(256))).reshape(4, 4, 4)
        in_color, in_depth, color_w, color_h, depth_w, depth_h = struct.unpack("<2i4I", opened.read(24))
        units_per_metre, frames = struct.unpack("<fQ", opened.read(12))
    except struct.error:
        raise damaged from None
    K_color, K_depth = matrices[0], matrices[2]
    T_base_color, T_base_depth = nearest_rigid(matrices[1]), nearest_rigid(matrices[3])
    sizes = (color_w, color_h), (depth_w, depth_h)
    if (
        T_base_color is None
        or T_base_depth is None
        or not (np.isfinite(units_per_metre) and units_per_metre > 0)
        or not all(0 < width_px * height_px <= MAX_IMAGE_PIXELS for width_px, height_px in sizes)
    ):
        raise damaged
    _check_compressions(file, in_color, in_depth)
    cameras = [
        CameraIntrinsics.pinhole(float(K[0, 0]), float(K[1, 1]), float(K[0, 2]), float(K[1, 2]), *size)
        for K, size in zip((K_color, K_depth), sizes, strict=True)
    ]
    for camera in cameras:
        check_camera(f"The header of {file}", camera)
    T_color_depth = inverse(T_base_color) @ T_base_depth
    return _Header((cameras[0], cameras[1]), T_color_depth, in_color, in_depth, units_per_metre, frames)


def _check_compressions(file: Path, color: int, depth: int) -> None:
    if depth == _OCCIPITAL:
        raise InputError(
            f"The depth of {file} is in Occipital's own compression, which is not read; try ScanNet's "
            "SensReader, which exports color/, depth/, pose/ and intrinsic/"
        )
    if depth not in (_RAW_DEPTH, _ZLIB) or color not in _COLORS:
        raise InputError(
            f"{file} has an unknown compression (colour {color}, depth {depth}); try ScanNet's SensReader, "
            "which exports color/, depth/, pose/ and intrinsic/"
        )


def _frames(opened: BinaryIO, count: int, size_bytes: int) -> Iterator[_Frame]:
    """Yield the frames that are complete."""
    at = opened.tell()
    for _ in range(count):
        opened.seek(at)
        values = opened.read(_FRAME.size)
        if len(values) < _FRAME.size:
            return
        *pose, color_us, _, color_bytes, depth_bytes = _FRAME.unpack(values)
        start, middle = at + _FRAME.size, at + _FRAME.size + color_bytes
        at = middle + depth_bytes
        if at > size_bytes:
            return
        yield _Frame(np.array(pose).reshape(4, 4), color_us, (start, color_bytes), (middle, depth_bytes))


def _color(file: Path, number: int, frame: _Frame, header: _Header) -> ByteArray:
    """Read (H, W, 3) RGB."""
    data, name = _bytes_at(file, *frame.color_at), f"{number} in {file}"
    if header.color_compression != _RAW_COLOR:
        return color_in(data, name)
    camera = header.cameras[0]
    if len(data) != 3 * camera.width_px * camera.height_px:
        raise InputError(f"The colour image {name} is truncated or damaged; try to copy the file again")
    return np.frombuffer(data, np.uint8).reshape(camera.height_px, camera.width_px, 3)


def _depth(file: Path, number: int, frame: _Frame, header: _Header) -> np.ndarray[Any, np.dtype[np.uint16]]:
    """Read (H, W) depth in the file's unit."""
    data, camera = _bytes_at(file, *frame.depth_at), header.cameras[1]
    size_bytes = 2 * camera.width_px * camera.height_px
    if header.depth_compression == _ZLIB:
        try:
            data = zlib.decompressobj().decompress(data, size_bytes + 1)
        except zlib.error:
            data = b""
    if len(data) != size_bytes:
        raise InputError(
            f"The depth image {number} in {file} is truncated or damaged; try to copy the file again"
        )
    return np.frombuffer(data, "<u2").reshape(camera.height_px, camera.width_px)


def _bytes_at(file: Path, start: int, size_bytes: int) -> bytes:
    if size_bytes > MAX_IMAGE_BYTES:
        raise InputError(f"{file} has an image of {size_bytes / 1e6:.0f} MB; try to copy it again")
    try:
        with file.open("rb") as opened:
            opened.seek(start)
            return opened.read(size_bytes)
    except OSError as error:
        raise InputError(f"{file} cannot be read ({error.strerror}); try another file") from None
