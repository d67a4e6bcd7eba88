"""Images as plain numbers: NumPy arrays, PFM and TIFF files."""

from __future__ import annotations

import io
import re

import numpy as np
from PIL import Image

from packetmesh.errors import InputError
from packetmesh.files import MAX_IMAGE_PIXELS
from pipeline.types import AnyPath

_NPY = b"\x93NUMPY"
_TIFF = (b"II*\x00", b"MM\x00*")
_PFM = re.compile(rb"(P[Ff])\s+(\d{1,9})\s+(\d{1,9})\s+([-+.\deE]{1,30})\s")
SIGNATURES = (_NPY, *_TIFF, b"Pf", b"PF")


def raw_values(path: AnyPath, data: bytes, what: str) -> np.ndarray:
    """(H, W) or (H, W, C) numbers as they stand in the file, rows from the top.

    Args:
        path: for the errors.
        data: the file's bytes, which begin with one of ``SIGNATURES``.
        what: for the errors, such as "depth image".

    Raises:
        InputError: truncated, damaged, too large, or no image.
    """
    read = _numpy if data.startswith(_NPY) else _tiff if data.startswith(_TIFF) else _pfm
    try:
        values = read(data)
    except _TooLarge as error:
        raise InputError(
            f"The {what} {path} has {error} pixels, more than the {MAX_IMAGE_PIXELS / 1e6:g} million that "
            "are read; try a smaller one"
        ) from None
    except Exception:  # decoders fail on damaged data in more ways than can be listed
        raise InputError(
            f"The {what} {path} is truncated or damaged; try to copy or export it again"
        ) from None
    if values.ndim not in (2, 3) or not values.size or values.dtype.kind not in "fiu":
        raise InputError(f"The {what} {path} is {values.dtype} of shape {values.shape}, which is no image")
    return values


class _TooLarge(Exception):
    """More pixels than are read; says how many."""


def _check(height_px: int, width_px: int) -> None:
    if height_px * width_px > MAX_IMAGE_PIXELS:
        raise _TooLarge(f"{width_px} x {height_px}")


def _numpy(data: bytes) -> np.ndarray:
    stream = io.BytesIO(data)
    version = np.lib.format.read_magic(stream)
    read = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
    shape = read(stream)[0]
    _check(*shape[:2])
    return np.lib.format.read_array(io.BytesIO(data), allow_pickle=False)


def _tiff(data: bytes) -> np.ndarray:
    with Image.open(io.BytesIO(data), formats=["TIFF"]) as image:
        _check(image.height, image.width)
        return np.asarray(image)


def _pfm(data: bytes) -> np.ndarray:
    """Portable float map, rows from the bottom; the scale's sign is the byte order."""
    header = _PFM.match(data)
    if header is None:
        raise ValueError
    width, height, channels = int(header[2]), int(header[3]), 3 if header[1] == b"PF" else 1
    _check(height, width)
    order = "<f4" if float(header[4]) < 0.0 else ">f4"
    values = np.frombuffer(data, order, width * height * channels, header.end())
    image = values.reshape(height, width, channels)[::-1].astype(np.float32)
    return image[..., 0] if channels == 1 else image
