"""Colour and depth images."""

from __future__ import annotations

import re
import zlib

import cv2
import numpy as np
from numpy.typing import NDArray

from packetmesh.errors import InputError
from packetmesh.files import MAX_IMAGE_BYTES, MAX_IMAGE_PIXELS, atomic_path, read_bytes
from pipeline.io.raw_images import SIGNATURES, raw_values
from pipeline.types import AnyPath, ByteArray, DepthMap

COMMON_DEPTH_SCALES = (1.0, 100.0, 256.0, 1000.0, 5000.0, 10000.0)
"""Units per metre that RGB-D data sets use."""
PLAUSIBLE_MEDIAN_M = (0.01, 100.0)
NO_VALUE = 65535
"""What some data sets (7-Scenes) write where the depth is unknown, beside 0."""
FARTHEST_M = 65.534
"""What is left for 16 bits of millimetres."""
FARTHEST_FLOAT_M, MOST_FAR_SHARE = 1e6, 0.05
"""Floating-point depths beyond are none; so many of them tell of a file that is understood wrongly."""
_TYPICAL_DEPTH_M = 2.0
_PNG_SIGNATURE = b"\x89PNG\r\n\x1a\n"
_JPEG_SIGNATURE = b"\xff\xd8"
_JPEG_END = b"\xff\xd9"
_PNM_SIGNATURES = (b"P5", b"P6")
_PNM_SPACE = rb"(?:\s|#[^\n]*+\n)++"
_PNM_HEADER = re.compile(rb"P[56]" + (_PNM_SPACE + rb"(\d{1,9})") * 3 + rb"\s")
"""Width, height and largest value, with comments between them."""


def read_color(path: AnyPath) -> ByteArray:
    """(H, W, 3) RGB of a PNG, JPEG, PGM, PPM, TIFF or NPY file; grey images get three equal channels.

    Raises:
        InputError: missing, truncated, too large, or none of these.
    """
    raw = _raw(path, "colour image")
    if raw is not None:
        return _rgb_of(path, raw)
    bgr = _decode(path, cv2.IMREAD_COLOR | cv2.IMREAD_IGNORE_ORIENTATION, "colour image")
    return np.ascontiguousarray(bgr[..., ::-1])


def read_depth(path: AnyPath, depth_scale: float = 1000.0) -> DepthMap:
    """Metric depth of a PNG, PGM, TIFF, PFM, OpenEXR or NPY image; 0 and, in 16 bits, 65535 mean unknown.

    Args:
        path: the file.
        depth_scale: image units per metre; 1000 when the image holds millimetres. Floating-point numbers
            are metres, whatever it is.

    Raises:
        InputError: missing, truncated, too large, not one channel of depth, without any depth, or with a
            median depth that no room has at this scale.
    """
    if not (np.isfinite(depth_scale) and depth_scale > 0):
        raise InputError(f"The depth scale for {path} is {depth_scale}; try 1000 for an image in millimetres")
    raw = _raw(path, "depth image")
    if raw is not None and raw.dtype.kind == "f":
        return _metres_of(path, raw)
    units = read_depth_units(path)
    known = units > 0
    _check_scale(path, float(np.median(units[known])), depth_scale)
    z_m = (units / depth_scale).astype(np.float32)
    z_m[~known] = np.nan
    return DepthMap(z_m)


def read_depth_units(path: AnyPath) -> NDArray[np.uint16]:
    """(H, W) values of a 16-bit image, 0 where the depth is unknown; 65535 becomes 0, too.

    Raises:
        InputError: missing, truncated, too large, not 16-bit grey, or without any depth.
    """
    raw = _raw(path, "depth image")
    units = _decode(path, cv2.IMREAD_UNCHANGED, "depth image") if raw is None else raw.copy()
    if units.dtype != np.uint16 or units.ndim != 2:
        channels = 1 if units.ndim == 2 else units.shape[2]
        raise InputError(
            f"The depth image {path} has {channels} channel(s) of {8 * units.itemsize} bits where one of 16 "
            "is needed; try the file with the raw depth, not a preview of it"
        )
    units[units == NO_VALUE] = 0
    if not units.any():
        raise InputError(f"The depth image {path} is zero everywhere; try another exposure of the scene")
    return units


def write_color(path: AnyPath, rgb: ByteArray) -> None:
    """Write (H, W, 3) RGB in the format of the suffix.

    Raises:
        InputError: the folder cannot be written.
    """
    with atomic_path(path) as sibling:
        sibling.write_bytes(cv2.imencode(sibling.suffix, rgb[..., ::-1])[1].tobytes())


def jpeg_of(rgb: ByteArray, quality: int = 88) -> bytes:
    """(H, W, 3) RGB as a JPEG file."""
    return cv2.imencode(".jpg", rgb[..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, quality])[1].tobytes()


def write_depth_mm(path: AnyPath, depth: DepthMap) -> None:
    """Write a 16-bit PNG in millimetres, 0 where the depth is unknown.

    Raises:
        InputError: a depth that 16 bits cannot hold, or a folder that cannot be written.
    """
    depth_mm = np.rint(np.where(depth.valid, depth.z_m, 0.0).astype(np.float64) * 1000.0)
    if depth_mm.min() < 0 or depth_mm.max() >= NO_VALUE:
        raise InputError(
            f"{path} cannot hold depths from {depth_mm.min() / 1000:.1f} m to {depth_mm.max() / 1000:.1f} m; "
            "try to keep to 0 to 65.5 m"
        )
    with atomic_path(path) as sibling:
        sibling.write_bytes(cv2.imencode(".png", depth_mm.astype(np.uint16))[1].tobytes())


def _raw(path: AnyPath, what: str) -> np.ndarray | None:
    """The numbers of a file that holds them plainly; None for one that is to be decoded."""
    data = read_bytes(path, MAX_IMAGE_BYTES, what)
    return raw_values(path, data, what) if data.startswith(SIGNATURES) else None


def _rgb_of(path: AnyPath, values: np.ndarray) -> ByteArray:
    """(H, W, 3) bytes of an image with one, three or four channels."""
    if values.ndim == 2:
        values = np.stack([values] * 3, axis=-1)
    if values.dtype != np.uint8 or values.shape[2] not in (3, 4):
        raise InputError(
            f"The colour image {path} is {values.dtype} of shape {values.shape}; try 8 bits in three channels"
        )
    return np.ascontiguousarray(values[..., :3])


def _metres_of(path: AnyPath, values: np.ndarray) -> DepthMap:
    """Depth in floating point."""
    if values.ndim != 2:
        raise InputError(f"The depth image {path} has {values.shape[2]} channels where one is needed")
    known = np.isfinite(values) & (values > 0)
    if not known.any():
        raise InputError(f"The depth image {path} has no depth anywhere; try another exposure of the scene")
    median_m = float(np.median(values[known]))
    if not PLAUSIBLE_MEDIAN_M[0] <= median_m <= PLAUSIBLE_MEDIAN_M[1]:
        raise InputError(
            f"The depth image {path} has a median depth of {median_m:.3g}; floating-point depth is in "
            "metres, so try to divide it by 1000 if it is millimetres"
        )
    if (values[known] > FARTHEST_FLOAT_M).mean() > MOST_FAR_SHARE:
        raise InputError(
            f"The numbers in the depth image {path} are no depths, as if their bytes were in another order; "
            "try to export it again"
        )
    return DepthMap(np.where(known, values, np.nan).astype(np.float32))


def _decode(path: AnyPath, flags: int, what: str) -> np.ndarray:
    data = read_bytes(path, MAX_IMAGE_BYTES, what)
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
    """Whether nothing is missing at the end of a file."""
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
    """Whether all chunks up to the last are there with right checksums; decoders trust their lengths."""
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
    """Width and height from the header of a file, before anything is decoded; 0 x 0 if absent."""
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


def _check_scale(path: AnyPath, median_units: float, depth_scale: float) -> None:
    nearest_m, farthest_m = PLAUSIBLE_MEDIAN_M
    median_m = median_units / depth_scale
    if nearest_m <= median_m <= farthest_m:
        return
    suggestion = likely_depth_scale(median_units)
    raise InputError(
        f"The depth image {path} has a median depth of {median_m:.3g} m at depth scale {depth_scale:g}; "
        f"try depth scale {suggestion:g}, which makes it {median_units / suggestion:.3g} m"
    )


def likely_depth_scale(median_units: float) -> float:
    """The usual depth scale at which this median comes nearest to 2 m."""
    typical_scale = median_units / _TYPICAL_DEPTH_M
    return min(COMMON_DEPTH_SCALES, key=lambda scale: abs(np.log(scale / typical_scale)))
