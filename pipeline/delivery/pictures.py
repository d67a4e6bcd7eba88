"""PNG and JPEG streams, and JPEG and AVIF images without their headers, which sender and sink both know."""

from __future__ import annotations

import io
from functools import lru_cache

import cv2
import numpy as np
from numpy.typing import NDArray
from PIL import Image, features

from packetmesh.errors import InputError
from pipeline.types import ByteArray

COLOR_QUALITY = 90
"""JPEG quality, 0 to 100 (SPEC 6.5)."""
AV1_QUALITY = 82
"""Of 100: the lowest at which each image of 24 validation rooms is at least as similar to the one sent (SSIM)
as JPEG's of ``COLOR_QUALITY`` (74 in the median); real frames need 84 (``packetmesh bench --only
codings``)."""
_AV1_SPEED = 8  # 6 takes 4 % less bytes and about twice the time, 10 takes 10 % more
_PNG_LEVEL = 6  # OpenCV's default, 1, is three times as fast and makes depth a quarter larger
_END_OF_IMAGE = b"\xff\xd9"
_START_OF_SCAN = 0xDA
_EXTENT_LENGTH = 22  # of the box iloc with one image, from its name


def write_png(image: NDArray[np.unsignedinteger]) -> bytes:
    """Encode (H, W) depths of 16 bits or an (H, W, 3) RGB image as PNG."""
    return cv2.imencode(".png", _swapped(image), [cv2.IMWRITE_PNG_COMPRESSION, _PNG_LEVEL])[1].tobytes()


def write_jpeg(rgb: ByteArray, quality: int = COLOR_QUALITY) -> bytes:
    """Encode an (H, W, 3) RGB image as JPEG, chroma at half resolution."""
    return cv2.imencode(".jpg", _swapped(rgb), [cv2.IMWRITE_JPEG_QUALITY, quality])[1].tobytes()


def read_picture(stream: bytes) -> NDArray[np.unsignedinteger]:
    """Decode a complete PNG or JPEG stream.

    Raises:
        InputError: the stream is neither.
    """
    image = cv2.imdecode(np.frombuffer(stream, np.uint8), cv2.IMREAD_UNCHANGED)
    if image is None:
        raise InputError(f"The {len(stream)} bytes are no PNG or JPEG picture; try to receive them again")
    return _swapped(image)


def write_scan(rgb: ByteArray, quality: int = COLOR_QUALITY) -> bytes:
    """Encode a JPEG stream and omit its header, equal for all images of one size, and its end marker.

    The header has over 600 bytes, more than a small tile's picture.
    """
    return write_jpeg(rgb, quality)[len(_header(rgb.shape[:2], quality)) : -len(_END_OF_IMAGE)]


@lru_cache(maxsize=4096)
def read_scan(scan: bytes, shape: tuple[int, int], quality: int = COLOR_QUALITY) -> ByteArray:
    """Decode an image of (H, W) pixels from ``write_scan``; read-only.

    Results are cached, because a sink that decodes repeatedly meets the same tiles.
    """
    image = read_picture(_header(shape, quality) + scan + _END_OF_IMAGE)
    image.setflags(write=False)
    return image


def write_av1(rgb: ByteArray, quality: int = AV1_QUALITY) -> bytes:
    """Encode an image as AVIF and omit what is equal for all images of one size, some 290 bytes.

    Raises:
        InputError: this Pillow writes no AVIF, or not with the same header for all.
    """
    stream = _write_avif(rgb, quality)
    frame = stream[len(_av1_header(rgb.shape[:2], quality)) :]
    if _with_av1_header(frame, rgb.shape[:2], quality) != stream:
        raise InputError(
            "Pillow's AVIF images differ in their headers; install the locked version of Pillow, or try the "
            "coding jpeg"
        )
    return frame


@lru_cache(maxsize=4096)
def read_av1(frame: bytes, shape: tuple[int, int], quality: int = AV1_QUALITY) -> ByteArray:
    """Decode an image of (H, W) pixels from ``write_av1``; read-only, and cached as in ``read_scan``.

    Raises:
        InputError: the bytes are no such image.
    """
    try:
        with Image.open(io.BytesIO(_with_av1_header(frame, shape, quality))) as picture:
            image: ByteArray = np.asarray(picture.convert("RGB"))
    except (OSError, RuntimeError, SyntaxError, ValueError) as error:
        raise InputError(f"The {len(frame)} bytes are no AVIF picture; try to receive them again") from error
    image.setflags(write=False)
    return image


def _write_avif(rgb: ByteArray, quality: int) -> bytes:
    """Encode with Pillow, as OpenCV's wheel for Windows has no AVIF; with one thread, for equal bytes."""
    if not features.check("avif"):
        raise InputError("This Pillow has no AVIF; install its wheel from PyPI, or try the coding tiles")
    stream = io.BytesIO()
    Image.fromarray(np.ascontiguousarray(rgb)).save(
        stream, "AVIF", quality=quality, speed=_AV1_SPEED, max_threads=1
    )
    return stream.getvalue()


@lru_cache(maxsize=32)
def _av1_header(shape: tuple[int, int], quality: int) -> bytes:
    """Return everything before the coded frame: the file's boxes, and AV1's sequence header.

    The last box, mdat, holds the units of AV1: a temporal delimiter of two bytes, the sequence header, whose
    length is its second byte, and the frame.
    """
    stream = _write_avif(np.zeros((*shape, 3), np.uint8), quality)
    units = stream.index(b"mdat") + 4
    return stream[: units + 4 + stream[units + 3]]


def _with_av1_header(frame: bytes, shape: tuple[int, int], quality: int) -> bytes:
    """Return the file, whose boxes iloc and mdat state the length of the units."""
    header = bytearray(_av1_header(shape, quality))
    units = header.index(b"mdat") + 4
    length = len(header) - units + len(frame)
    place = header.index(b"iloc") + _EXTENT_LENGTH
    header[place : place + 4] = length.to_bytes(4, "big")
    header[units - 8 : units - 4] = (length + 8).to_bytes(4, "big")
    return bytes(header) + frame


@lru_cache(maxsize=32)
def _header(shape: tuple[int, int], quality: int) -> bytes:
    """Return everything in a JPEG stream before the coded image."""
    stream = write_jpeg(np.zeros((*shape, 3), np.uint8), quality)
    position = 2
    while stream[position + 1] != _START_OF_SCAN:
        position += 2 + int.from_bytes(stream[position + 2 : position + 4], "big")
    return stream[: position + 2 + int.from_bytes(stream[position + 2 : position + 4], "big")]


def _swapped(image: NDArray) -> NDArray:
    """Convert between RGB and OpenCV's BGR; depths are returned unchanged."""
    return image if image.ndim == 2 else np.ascontiguousarray(image[..., ::-1])
