"""Reading and writing of colour and depth images."""

from __future__ import annotations

import re
import zlib
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from packetmesh.errors import InputError
from packetmesh.files import MAX_IMAGE_BYTES, MAX_IMAGE_PIXELS, atomic_path, read_bytes
from pipeline.io.depth_scale import NO_VALUE, check_median, doubts, known_in, usual_scale
from pipeline.io.raw_images import SIGNATURES, raw_values
from pipeline.types import AnyPath, ByteArray, DepthMap

IMAGE_SUFFIXES = (".png", ".jpg", ".jpeg", ".pgm", ".ppm", ".tif", ".tiff", ".npy", ".pfm", ".exr")
_PNG_SIGNATURE = b"\x89PNG\r\n\x1a\n"
_JPEG_SIGNATURE = b"\xff\xd8"
_JPEG_END = b"\xff\xd9"
_PNM_SIGNATURES = (b"P5", b"P6")
_PNM_SPACE = rb"(?:\s|#[^\n]*+\n)++"
_PNM_HEADER = re.compile(rb"P[56]" + (_PNM_SPACE + rb"(\d{1,9})") * 3 + rb"\s")
"""Width, height and largest value, with comments between them."""


def images_in(folder: Path, stem: str) -> list[Path]:
    """Return the images of this stem, such as color.png and color.jpg, by name."""
    return [file for file in sorted(folder.glob(f"{stem}.*")) if file.suffix.lower() in IMAGE_SUFFIXES]


def read_color(path: AnyPath) -> ByteArray:
    """Read (H, W, 3) RGB from a PNG, JPEG, PGM, PPM, TIFF or NPY file; grey images get three equal channels.

    Raises:
        InputError: the file is missing, truncated, too large, or of another format.
    """
    return color_in(read_bytes(path, MAX_IMAGE_BYTES, "colour image"), path)


def color_in(data: bytes, name: AnyPath) -> ByteArray:
    """Decode (H, W, 3) RGB from the bytes of an image file; ``name`` is for the errors of ``read_color``."""
    if data.startswith(SIGNATURES):
        return _rgb_of(name, raw_values(name, data, "colour image"))
    bgr = _decode(name, data, cv2.IMREAD_COLOR | cv2.IMREAD_IGNORE_ORIENTATION, "colour image")
    return np.ascontiguousarray(bgr[..., ::-1])


class NoDepthError(InputError):
    """A depth image, or a recording, in which all depth is unknown."""


@dataclass(frozen=True, slots=True)
class ReadDepth:
    """A depth image with the scale at which it was read."""

    depth: DepthMap
    units_per_metre: float
    find_notes: Callable[[], tuple[str, ...]]
    """Computes ``notes`` on request, as most readers of a recording's frames need none."""

    @property
    def notes(self) -> tuple[str, ...]:
        """Doubts about the depth and its scale, one sentence each."""
        return self.find_notes()


def read_depth(path: AnyPath, depth_scale: float | None = None) -> DepthMap:
    """Read metric depth from a PNG, PGM, TIFF, PFM, OpenEXR or NPY image, as ``read_depth_noted`` does."""
    return read_depth_noted(path, depth_scale).depth


def read_depth_noted(path: AnyPath, depth_scale: float | None = None) -> ReadDepth:
    """Read metric depth from a PNG, PGM, TIFF, PFM, OpenEXR or NPY image, with doubts about its scale.

    Args:
        path: the file; 0 and, in whole numbers, 65535 mean unknown.
        depth_scale: image units per metre; by default whole numbers are millimetres and floating-point
            numbers metres.

    Raises:
        InputError: the file is missing, truncated, too large, not one channel of depth, without any depth,
            or has an implausible median depth at this scale.
    """
    if depth_scale is not None and not (np.isfinite(depth_scale) and depth_scale > 0):
        raise InputError(f"The depth scale for {path} is {depth_scale}; try 1000 for an image in millimetres")
    values = read_depth_values(path)
    scale = usual_scale(values) if depth_scale is None else depth_scale
    check_median(path, values, scale)
    z_m = (values / scale).astype(np.float32)
    z_m[~known_in(values)] = np.nan
    return ReadDepth(DepthMap(z_m), scale, partial(doubts, values, scale, depth_scale is not None))


def read_depth_values(path: AnyPath) -> NDArray[Any]:
    """Read (H, W) values as stored in a depth image; at least one is known (``known_in``).

    Raises:
        InputError: the file is missing, truncated, too large, or not one channel of 16 bits or more;
            NoDepthError if no depth is known.
    """
    data = read_bytes(path, MAX_IMAGE_BYTES, "depth image")
    if data.startswith(SIGNATURES):
        values = raw_values(path, data, "depth image")
    else:
        values = _decode(path, data, cv2.IMREAD_UNCHANGED, "depth image")
    if values.ndim != 2 or values.itemsize < 2:
        channels = 1 if values.ndim == 2 else values.shape[2]
        raise InputError(
            f"The depth image {path} has {channels} channel(s) of {8 * values.itemsize} bits where one of 16 "
            "or more is needed; try the file with the raw depth, not a preview of it"
        )
    if not known_in(values).any():
        raise NoDepthError(f"The depth image {path} has no depth anywhere; try another exposure of the scene")
    return values


def read_depth_units(path: AnyPath) -> NDArray[Any]:
    """Read (H, W) values of a depth image, 0 where the depth is unknown.

    Raises:
        InputError: as for ``read_depth_values``.
    """
    values = read_depth_values(path)
    return np.where(known_in(values), values, values.dtype.type(0))


def write_color(path: AnyPath, rgb: ByteArray) -> None:
    """Write (H, W, 3) RGB in the format of the suffix.

    Raises:
        InputError: the folder cannot be written.
    """
    with atomic_path(path) as sibling:
        sibling.write_bytes(cv2.imencode(sibling.suffix, rgb[..., ::-1])[1].tobytes())


def jpeg_of(rgb: ByteArray, quality: int = 88) -> bytes:
    """Encode (H, W, 3) RGB as a JPEG file."""
    return cv2.imencode(".jpg", rgb[..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, quality])[1].tobytes()


def write_depth_mm(path: AnyPath, depth: DepthMap) -> None:
    """Write a 16-bit PNG in millimetres, 0 where the depth is unknown.

    Raises:
        InputError: a depth exceeds 16 bits, or the folder cannot be written.
    """
    depth_mm = np.rint(np.where(depth.valid, depth.z_m, 0.0).astype(np.float64) * 1000.0)
    if depth_mm.min() < 0 or depth_mm.max() >= NO_VALUE:
        raise InputError(
            f"{path} cannot hold depths from {depth_mm.min() / 1000:.1f} m to {depth_mm.max() / 1000:.1f} m; "
            "try to keep to 0 to 65.5 m"
        )
    with atomic_path(path) as sibling:
        sibling.write_bytes(cv2.imencode(".png", depth_mm.astype(np.uint16))[1].tobytes())


def _rgb_of(path: AnyPath, values: np.ndarray) -> ByteArray:
    """Convert an image with one, three or four channels to (H, W, 3) bytes."""
    if values.ndim == 2:
        values = np.stack([values] * 3, axis=-1)
    if values.dtype != np.uint8 or values.shape[2] not in (3, 4):
        raise InputError(
            f"The colour image {path} is {values.dtype} of shape {values.shape}; try 8 bits in three channels"
        )
    return np.ascontiguousarray(values[..., :3])


def _decode(path: AnyPath, data: bytes, flags: int, what: str) -> np.ndarray:
    if not data.startswith((_PNG_SIGNATURE, _JPEG_SIGNATURE, *_PNM_SIGNATURES)):
        raise InputError(
            f"The {what} {path} is neither a PNG nor a JPEG file, nor PGM, PPM, TIFF or NPY; try to convert "
            "it to PNG"
        )
    complete = _is_whole(data)
    width_px, height_px = _size_px(data)
    if complete and width_px * height_px > MAX_IMAGE_PIXELS:
        raise InputError(
            f"The {what} {path} has {width_px} x {height_px} pixels, more than the "
            f"{MAX_IMAGE_PIXELS / 1e6:g} million that are read; try a smaller one"
        )
    image = cv2.imdecode(np.frombuffer(data, np.uint8), flags) if complete else None
    if image is None:
        raise InputError(f"The {what} {path} is truncated or damaged; try to copy or export it again")
    return image


def _is_whole(data: bytes) -> bool:
    """Return whether a file is not truncated; of a JPEG, whether it has an end marker anywhere."""
    if data.startswith(_PNG_SIGNATURE):
        return _png_is_whole(data)
    if data.startswith(_PNM_SIGNATURES):
        header = _PNM_HEADER.match(data)
        if header is None:
            return False
        width, height, most = map(int, header.groups())
        channels, value_bytes = 3 if data.startswith(b"P6") else 1, 1 if most < 256 else 2
        return len(data) - header.end() >= width * height * channels * value_bytes
    return data.rfind(_JPEG_END) >= 0


def _png_is_whole(data: bytes) -> bool:
    """Return whether all chunks are present with correct checksums, because decoders trust their lengths."""
    view = memoryview(data)
    position = len(_PNG_SIGNATURE)
    while position + 12 <= len(data):
        end = position + 8 + int.from_bytes(view[position : position + 4], "big")
        if zlib.crc32(view[position + 4 : end]) != int.from_bytes(view[end : end + 4], "big"):
            return False
        if view[position + 4 : position + 8] == b"IEND":
            return True
        position = end + 4
    return False


def _size_px(data: bytes) -> tuple[int, int]:
    """Read width and height from a file's header before decoding; 0 x 0 if absent."""
    if data.startswith(_PNG_SIGNATURE):
        return int.from_bytes(data[16:20], "big"), int.from_bytes(data[20:24], "big")
    if data.startswith(_PNM_SIGNATURES):
        header = _PNM_HEADER.match(data)
        return (int(header[1]), int(header[2])) if header else (0, 0)
    position = 2
    while position + 9 <= len(data) and data[position] == 0xFF:
        marker = data[position + 1]
        if 0xC0 <= marker <= 0xCF and marker not in (0xC4, 0xC8, 0xCC):  # start of frame
            height, width = data[position + 5 : position + 7], data[position + 7 : position + 9]
            return int.from_bytes(width, "big"), int.from_bytes(height, "big")
        position += 2 + int.from_bytes(data[position + 2 : position + 4], "big")
    return 0, 0
