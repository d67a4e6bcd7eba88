"""Readers of images not decoded by OpenCV: NumPy, PFM, TIFF and, with the extra ``exr``, OpenEXR."""

from __future__ import annotations

import contextlib
import io
import re

import numpy as np
from PIL import Image

from packetmesh.errors import InputError
from packetmesh.files import MAX_IMAGE_PIXELS
from pipeline.io.numpy_files import array_in
from pipeline.types import AnyPath

_NPY = b"\x93NUMPY"
_TIFF = (b"II*\x00", b"MM\x00*")
_OTHER_MODES = ("P", "PA", "LA", "CMYK", "YCbCr", "LAB")
"""Pillow's modes of TIFF images whose numbers are not grey, or red, green and blue."""
_EXR = b"\x76\x2f\x31\x01"
_EXR_DEPTH = ("Z", "Y", "V")
"""Names of single channels in OpenEXR files, in order of preference."""
_PFM = re.compile(rb"(P[Ff])\s+(\d{1,9})\s+(\d{1,9})\s+([-+.\deE]{1,30})\s")
SIGNATURES = (_NPY, *_TIFF, b"Pf", b"PF", _EXR)


def raw_values(path: AnyPath, data: bytes, what: str) -> np.ndarray:
    """Return (H, W) or (H, W, C) numbers as stored in the file, rows from the top.

    Args:
        path: path for error messages.
        data: the file's bytes, which begin with one of ``SIGNATURES``.
        what: kind of image for error messages, such as "depth image".

    Raises:
        InputError: the file is truncated, damaged, too large, no image, or OpenEXR without the extra.
    """
    readers = {_NPY: _numpy, **dict.fromkeys(_TIFF, _tiff), _EXR: _exr}
    read = next((reader for signature, reader in readers.items() if data.startswith(signature)), _pfm)
    try:
        values = read(data)
    except ImportError:
        raise InputError(
            f"Reading the {what} {path} needs OpenEXR; try pip install 'packetmesh[exr]', or TIFF"
        ) from None
    except _OtherChannels as error:
        raise InputError(
            f"The {what} {path} has the channels {error}; try one channel, one named Z, Y or V, or R, G, B"
        ) from None
    except _SeveralImages as error:
        raise InputError(f"The {what} {path} holds {error} images; try a file with one of them") from None
    except _TooLarge as error:
        raise InputError(
            f"The {what} {path} has {error} pixels, more than the {MAX_IMAGE_PIXELS / 1e6:g} million that "
            "are read; try a smaller one"
        ) from None
    except Exception:  # decoders fail on damaged data in more ways than can be listed
        raise InputError(
            f"The {what} {path} is truncated or damaged, or stored in a way that is not read; try to copy it "
            "again, or to export it as PNG"
        ) from None
    if values.ndim not in (2, 3) or not values.size or values.dtype.kind not in "fiu":
        raise InputError(
            f"The {what} {path} is {values.dtype} of shape {values.shape}, which is no image; try numbers of "
            "shape (height, width), or (height, width, 3) of colour"
        )
    return values


class _TooLarge(Exception):
    """The image exceeds the largest number of pixels; the error's text is the image size."""


class _SeveralImages(Exception):
    """A TIFF file has several images; the error's text is their number."""


class _OtherChannels(Exception):
    """An OpenEXR file has no channel that is read; the error's text is the names of its channels."""


def _check(height_px: int, width_px: int) -> None:
    if height_px * width_px > MAX_IMAGE_PIXELS:
        raise _TooLarge(f"{width_px} x {height_px}")


def _numpy(data: bytes) -> np.ndarray:
    values = array_in(data)
    if values.ndim == 3 and values.shape[2] == 1:
        values = values[..., 0]
    elif values.ndim == 3 and values.shape[0] == 1 and values.shape[2] > 4:  # channel first, as networks do
        values = values[0]
    if values.ndim > 1:
        _check(*values.shape[:2])
    return values.astype(np.float32) if values.dtype == np.float16 else values


def _tiff(data: bytes) -> np.ndarray:
    with Image.open(io.BytesIO(data), formats=["TIFF"]) as image:
        _check(image.height, image.width)
        pages = getattr(image, "n_frames", 1)
        if pages > 1:
            raise _SeveralImages(pages)
        return np.asarray(image.convert("RGB") if image.mode in _OTHER_MODES else image)


def _exr(data: bytes) -> np.ndarray:
    """Return the only channel of a depth image, or red, green and blue."""
    import OpenEXR

    corners = OpenEXR.File(io.BytesIO(data), header_only=True).header()["dataWindow"]
    width_px, height_px = (int(last - first) + 1 for first, last in zip(*corners, strict=True))
    _check(height_px, width_px)
    quiet = contextlib.redirect_stdout(io.StringIO())  # OpenEXR prints warnings to standard output
    with quiet, OpenEXR.File(io.BytesIO(data), separate_channels=True) as file:
        channels = {name: channel.pixels for name, channel in file.channels().items()}
    if {"R", "G", "B"} <= channels.keys():
        return np.stack([channels[name] for name in "RGB"], axis=-1)
    known = list(channels) if len(channels) == 1 else [name for name in _EXR_DEPTH if name in channels]
    if not known:
        raise _OtherChannels(", ".join(channels))
    return channels[known[0]].astype(np.float32)


def _pfm(data: bytes) -> np.ndarray:
    """Read a portable float map: rows from the bottom; the scale's sign determines the byte order."""
    header = _PFM.match(data)
    if header is None:
        raise ValueError
    width, height, channels = int(header[2]), int(header[3]), 3 if header[1] == b"PF" else 1
    _check(height, width)
    order = "<f4" if float(header[4]) < 0.0 else ">f4"
    values = np.frombuffer(data, order, width * height * channels, header.end())
    image = values.reshape(height, width, channels)[::-1].astype(np.float32)
    return image[..., 0] if channels == 1 else image
