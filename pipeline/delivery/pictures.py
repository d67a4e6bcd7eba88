"""PNG and JPEG streams, and JPEG pictures without the header that both sides know already."""

from __future__ import annotations

from functools import lru_cache

import cv2
import numpy as np
from numpy.typing import NDArray

from packetmesh.errors import InputError
from pipeline.types import ByteArray

COLOR_QUALITY = 90
"""Of JPEG, 0 to 100 (SPEC 6.5)."""
_PNG_LEVEL = 6  # OpenCV's own, 1, is thrice as fast and makes depth a quarter larger
_END_OF_IMAGE = b"\xff\xd9"
_START_OF_SCAN = 0xDA


def write_png(image: NDArray[np.unsignedinteger]) -> bytes:
    """The PNG stream of (H, W) depths of 16 bits or of an (H, W, 3) RGB image."""
    return cv2.imencode(".png", _swapped(image), [cv2.IMWRITE_PNG_COMPRESSION, _PNG_LEVEL])[1].tobytes()


def write_jpeg(rgb: ByteArray, quality: int = COLOR_QUALITY) -> bytes:
    """The JPEG stream of an (H, W, 3) RGB image, colour at half resolution."""
    return cv2.imencode(".jpg", _swapped(rgb), [cv2.IMWRITE_JPEG_QUALITY, quality])[1].tobytes()


def read_picture(stream: bytes) -> NDArray[np.unsignedinteger]:
    """The image of a whole PNG or JPEG stream.

    Raises:
        InputError: it is none.
    """
    image = cv2.imdecode(np.frombuffer(stream, np.uint8), cv2.IMREAD_UNCHANGED)
    if image is None:
        raise InputError(f"The {len(stream)} bytes are no PNG or JPEG picture; try to receive them again")
    return _swapped(image)


def write_scan(rgb: ByteArray, quality: int = COLOR_QUALITY) -> bytes:
    """A JPEG stream from behind its header, which is the same for all images of one size, to its end mark.

    The header has over 600 bytes, more than a small tile's picture.
    """
    return write_jpeg(rgb, quality)[len(_header(rgb.shape[:2], quality)) : -len(_END_OF_IMAGE)]


@lru_cache(maxsize=4096)
def read_scan(scan: bytes, shape: tuple[int, int], quality: int = COLOR_QUALITY) -> ByteArray:
    """The image of (H, W) pixels of ``write_scan``, not to be written to.

    It is remembered: a sink that looks often meets the same tiles.
    """
    image = read_picture(_header(shape, quality) + scan + _END_OF_IMAGE)
    image.setflags(write=False)
    return image


@lru_cache(maxsize=32)
def _header(shape: tuple[int, int], quality: int) -> bytes:
    """All of a JPEG stream before the coded picture."""
    stream = write_jpeg(np.zeros((*shape, 3), np.uint8), quality)
    position = 2
    while stream[position + 1] != _START_OF_SCAN:
        position += 2 + int.from_bytes(stream[position + 2 : position + 4], "big")
    return stream[: position + 2 + int.from_bytes(stream[position + 2 : position + 4], "big")]


def _swapped(image: NDArray) -> NDArray:
    """Between RGB and OpenCV's BGR; depths as they are."""
    return image if image.ndim == 2 else np.ascontiguousarray(image[..., ::-1])
