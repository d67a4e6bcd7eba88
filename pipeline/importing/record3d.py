"""Import of captures of Record3D: .r3d files, their unpacked folders, and its export as images.

Photographs and depth of a telephone's LiDAR or face camera, placed by ARKit; https://record3d.app. The layout
of .r3d, which is a ZIP, is that of viser's Record3dLoader.
"""

from __future__ import annotations

import re
import zipfile
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from packetmesh.errors import InputError
from packetmesh.files import (
    BROKEN_ZIP,
    MAX_IMAGE_BYTES,
    MAX_TEXT_BYTES,
    json_object,
    read_bytes,
    read_text,
    text_in,
    unpacked,
)
from pipeline.importing.arkit import Y_DOWN
from pipeline.importing.cameras import camera_of
from pipeline.importing.found_poses import found_poses
from pipeline.importing.lzfse_data import BLOCK, stated_size, unpack_lzfse
from pipeline.importing.pairing import color_folder, paired, pose_indices, require
from pipeline.importing.sequence import Candidate, Sequence, posed
from pipeline.importing.stored import StoredImage
from pipeline.io.images import color_in
from pipeline.io.intrinsics import check_camera
from pipeline.kernels.geometry import rigid, scaled_to
from pipeline.types import ByteArray, CameraIntrinsics, FloatArray

_METADATA = ("metadata.json", "metadata")
_MAX_METADATA_BYTES = 100 * MAX_TEXT_BYTES
_FRAME = re.compile(r"rgbd/(\d{1,9})\.(jpg|depth|conf)")


@dataclass(frozen=True, slots=True)
class _Metadata:
    """The cameras, poses and times of a capture."""

    camera: CameraIntrinsics
    each: list[CameraIntrinsics]
    """Cameras of the frames; empty if they are not given."""
    T_world_camera: dict[int, FloatArray]
    """(4, 4) by frame, metres."""
    times_s: list[float]
    """Times of the frames; empty if they are not given."""
    depth_shape: tuple[int, int] | None
    """Rows and columns of depth; None in old captures."""


@dataclass(frozen=True, slots=True)
class _Package:
    """The files of a capture, in a ZIP or a folder."""

    place: Path
    names: tuple[str, ...]
    """Names relative to the folder of the metadata."""
    read: Callable[[str, int], bytes]
    """Returns the bytes of a file by name; raises an InputError if it has more than the given number."""


def is_record3d(folder: Path) -> bool:
    """Return whether a folder contains metadata with a camera (K, w and h), and images or rgbd/."""
    file = _metadata_in(folder)
    if file is None or not (_has_images(folder) or (folder / "rgbd").is_dir()):
        return False
    try:
        return json_object(read_text(file, "metadata", _MAX_METADATA_BYTES), file, "metadata").keys() >= {
            "K",
            "w",
            "h",
        }
    except InputError:
        return False


def read_record3d(folder: Path, intrinsics: Path | None) -> Sequence:
    """Read an export as images (rgb/ and depth/ in metres) or an unpacked .r3d, with cameras and poses.

    Raises:
        InputError: no frame is complete, or the metadata have another form.
    """
    file, colors = _metadata_in(folder), color_folder(folder)
    assert file is not None
    if colors is None or not _has_images(folder):
        return _read_package(_folder_package(folder), file.name, intrinsics)
    pairs, unpaired = paired(colors, folder / "depth")
    metadata = _metadata(read_text(file, "metadata", _MAX_METADATA_BYTES), str(file))
    frames = pose_indices(pairs, max(len(metadata.each), max(metadata.T_world_camera, default=-1) + 1))
    images = {k: Candidate(pair.color, pair.depth) for k, pair in zip(frames, pairs, strict=True)}
    return _sequence(folder, images, metadata, file.name, intrinsics, unpaired)


def read_r3d(file: Path, intrinsics: Path | None) -> Sequence:
    """Read the frames of a .r3d file; their images are read when they are requested.

    Raises:
        InputError: it is no ZIP or damaged, no frame is complete, or the metadata have another form.
    """
    package, metadata = _zip_package(file)
    return _read_package(package, metadata, intrinsics)


def _read_package(package: _Package, metadata_name: str, intrinsics: Path | None) -> Sequence:
    """Read a capture whose depth and confidence are compressed."""
    text = package.read(metadata_name, _MAX_METADATA_BYTES)
    metadata = _metadata(text_in(text, "replace"), f"of {package.place}")
    found: dict[int, dict[str, str]] = {}
    for name in package.names:
        if match := _FRAME.fullmatch(name):
            found.setdefault(int(match[1]), {})[match[2]] = name
    complete = sorted(k for k, names in found.items() if names.keys() >= {"jpg", "depth"})
    require(complete, package.place, "rgbd/0.jpg and rgbd/0.depth")
    missing = len(found) - len(complete)
    lacks = f"{missing} of {len(found)} frames of {package.place} lack an image and were left out"
    first_rgb = _photograph(package, found[complete[0]]["jpg"])
    metadata = _resized(metadata, first_rgb.shape[1], first_rgb.shape[0])
    images = {k: _candidate(package, found[k], metadata) for k in complete}
    notes = (lacks,) if missing else ()
    return _sequence(package.place, images, metadata, metadata_name, intrinsics, notes)


def _candidate(package: _Package, names: dict[str, str], metadata: _Metadata) -> Candidate:
    """Return the images of a frame; ``names`` has the names of its files by suffix."""
    readers = {
        "jpg": partial(_photograph, package),
        "depth": partial(_pixels, package, dtype=np.dtype("<f4"), metadata=metadata),
        "conf": partial(_pixels, package, dtype=np.dtype(np.uint8), metadata=metadata),
    }
    stored = {
        suffix: StoredImage(package.place, name, partial(readers[suffix], name))
        for suffix, name in names.items()
    }
    return Candidate(stored["jpg"], stored["depth"], confidence=stored.get("conf"))


def _sequence(
    place: Path,
    images: dict[int, Candidate],
    metadata: _Metadata,
    metadata_name: str,
    intrinsics: Path | None,
    notes: tuple[str, ...],
) -> Sequence:
    """Return the frames with their cameras, poses and times; ``images`` has the images by frame number."""
    poses = found_poses({k: T for k, T in metadata.T_world_camera.items() if k in images})
    cameras = {} if intrinsics else dict(enumerate(metadata.each))
    times = dict(enumerate(metadata.times_s))
    candidates, without, pose_notes = posed(
        [
            replace(
                candidate,
                T_world_camera=poses.T_world_camera.get(k),
                camera=cameras.get(k),
                time_s=times[k] if times.keys() >= images.keys() else None,
            )
            for k, candidate in images.items()
        ],
        f"pose in {metadata_name}",
        poses,
    )
    camera = metadata.camera
    if intrinsics:
        camera, _ = camera_of(place, candidates[0].color, intrinsics, None, "")
    return Sequence(candidates, camera, without_poses=without, notes=(*notes, *pose_notes))


def _metadata(text: str, name: str) -> _Metadata:
    values = json_object(text, name, "metadata")
    try:
        size_px = int(values["w"]), int(values["h"])
        matrix = np.array(values["K"], dtype=np.float64).reshape(3, 3).T
        fx, fy, cx, cy = (float(matrix[at]) for at in ((0, 0), (1, 1), (0, 2), (1, 2)))
        camera = CameraIntrinsics.pinhole(fx, fy, cx, cy, *size_px)
        rows = np.array(values.get("perFrameIntrinsicCoeffs") or [], dtype=np.float64).reshape(-1, 4)
        each = [CameraIntrinsics.pinhole(fx, fy, cx, cy, *size_px) for fx, fy, cx, cy in rows.tolist()]
        poses = np.array(values.get("poses") or [], dtype=np.float64).reshape(-1, 7)
        times = np.array(values.get("frameTimestamps") or [], dtype=np.float64).reshape(-1)
        shape = (int(values["dh"]), int(values["dw"])) if values.get("dw") and values.get("dh") else None
        if shape is not None and min(shape) < 1:
            raise ValueError
        if not len(times) and values.get("fps"):
            times = np.arange(len(poses)) / float(values["fps"])
    except (KeyError, TypeError, ValueError, OverflowError):
        raise InputError(
            f"The metadata {name} are not in Record3D's format; try w, h, K of 9 numbers and poses of 7"
        ) from None
    for one in (camera, *each):
        check_camera(f"The metadata {name}", one)
    rising = np.isfinite(times).all() and bool((np.diff(times) > 0.0).all())
    known = {k: _from_arkit(row) for k, row in enumerate(poses) if np.linalg.norm(row[:4]) > 0.5}
    return _Metadata(camera, each, known, times.tolist() if rising else [], shape)


def _resized(metadata: _Metadata, width_px: int, height_px: int) -> _Metadata:
    """Return the metadata with the cameras of photographs of this size, if it has the same proportions."""
    camera = scaled_to(metadata.camera, width_px, height_px)
    if camera is None:
        return metadata
    each = [scaled_to(own, width_px, height_px) or own for own in metadata.each]
    return replace(metadata, camera=camera, each=each)


def _from_arkit(row: FloatArray) -> FloatArray:
    """Return the (4, 4) T_world_camera of a quaternion, its scalar last, and a position in ARKit's axes."""
    return rigid(Rotation.from_quat(row[:4]).as_matrix(), row[4:]) @ Y_DOWN


def _photograph(package: _Package, name: str) -> ByteArray:
    """Read (H, W, 3) RGB."""
    return color_in(package.read(name, MAX_IMAGE_BYTES), f"{name} in {package.place}")


def _pixels(package: _Package, name: str, dtype: np.dtype[Any], metadata: _Metadata) -> NDArray[Any]:
    """Read (H, W) depth, metres, or levels of confidence, 0 to 2."""
    data = package.read(name, MAX_IMAGE_BYTES)
    shape, compressed = metadata.depth_shape, data.startswith(BLOCK)
    size_bytes = stated_size(data) if compressed else len(data)
    if shape is None:
        shape = _proportional(size_bytes // dtype.itemsize, metadata.camera)
    elif not compressed and size_bytes != shape[0] * shape[1] * dtype.itemsize:
        raise InputError(
            f"{name} in {package.place} has an unknown compression, not LZFSE; try Record3D's export as EXR "
            "and JPG images"
        )
    if shape is not None and size_bytes == shape[0] * shape[1] * dtype.itemsize:
        unpacked = unpack_lzfse(data) if compressed else data
        if len(unpacked) == size_bytes:
            return np.frombuffer(unpacked, dtype).reshape(shape)
    raise InputError(f"{name} in {package.place} is truncated or damaged; try to export it again")


def _proportional(pixels: int, camera: CameraIntrinsics) -> tuple[int, int] | None:
    """Return rows and columns of an image of so many pixels in a camera's proportions; None if none fits."""
    columns = round((pixels * camera.width_px / camera.height_px) ** 0.5)
    if not columns or pixels % columns or scaled_to(camera, columns, pixels // columns) is None:
        return None
    return pixels // columns, columns


def _folder_package(folder: Path) -> _Package:
    names = tuple(f"rgbd/{path.name}" for path in sorted((folder / "rgbd").iterdir()))
    return _Package(folder, names, lambda name, most: read_bytes(folder / name, most, "file of Record3D"))


def _zip_package(file: Path) -> tuple[_Package, str]:
    """Return the files of a ZIP and the name of its metadata."""
    try:
        archive = zipfile.ZipFile(file)
    except BROKEN_ZIP:
        raise InputError(
            f"{file} is no ZIP, which a .r3d file is, or is damaged; try to export it again"
        ) from None
    items = {item.filename.removeprefix("./"): item for item in archive.infolist()}
    found = [name for name in items if name.split("/")[-1] in _METADATA]
    if not found:
        raise InputError(f"{file} has no metadata, which Record3D writes; try to export it again")
    metadata = min(found, key=lambda name: name.count("/"))
    start = metadata[: metadata.rfind("/") + 1]

    def read(name: str, most: int) -> bytes:
        item = items[f"{start}{name}"]
        if item.file_size > most:
            raise InputError(f"{name} in {file} is larger than {most / 1e6:g} MB; try to export it again")
        try:
            return unpacked(archive, item)
        except BROKEN_ZIP:
            raise InputError(f"{name} in {file} is truncated or damaged; try to export it again") from None

    names = tuple(name.removeprefix(start) for name in items if name.startswith(start))
    return _Package(file, names, read), metadata.removeprefix(start)


def _metadata_in(folder: Path) -> Path | None:
    return next((folder / name for name in _METADATA if (folder / name).is_file()), None)


def _has_images(folder: Path) -> bool:
    return color_folder(folder) is not None and (folder / "depth").is_dir()
