"""Cameras from the keys and values of JSON and YAML files: matrix, image size and lens under their names."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

import numpy as np

from packetmesh.errors import InputError
from pipeline.io.camera_files import COLMAP_MIDDLE
from pipeline.types import AnyPath, CameraIntrinsics, FloatArray

_MATRICES = ("camera_matrix", "K", "k")
_FOCAL = (("fx", "fy"), ("fl_x", "fl_y"))
"""The second pair is instant-ngp's and nerfstudio's, whose first pixel has its centre at (0.5, 0.5)."""
_PRINCIPAL = (("cx", "cy"), ("ppx", "ppy"))
"""The second pair is the RealSense SDK's."""
_WIDTHS, _HEIGHTS = ("image_width", "width", "w"), ("image_height", "height", "h")
_LENSES = (
    "distortion_coefficients",
    "D",
    "d",
    "distortion",
    "distortion_coeffs",
    "dist_coeffs",
    "dist_coeff",
    "dist",
    "coeffs",
)
_COEFFICIENTS = ("k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6")
_FISHEYE_COEFFICIENTS = ("k1", "k2", "k3", "k4")
_LIKE_A_LENS = re.compile(r"dist(?!ance)|coeff|^[kp]_?\d$", re.IGNORECASE)
_LIKE_A_SIZE = re.compile(r"width|height|resolution|size", re.IGNORECASE)
"""Keys that may hold a lens or an image size."""


def camera_of_keys(
    path: AnyPath, values: Mapping[str, Any], size_px: tuple[int, int] | None, fisheye: bool
) -> CameraIntrinsics | None:
    """Return the camera with all its distortion coefficients, at least five; None for an unknown format.

    Its images have the size ``size_px`` if the file does not give one.

    Args:
        path: the file, for errors.
        values: its keys and values.
        size_px: width and height of the images, if known.
        fisheye: whether the file names a fisheye's model, whose coefficients are k1 to k4.

    Raises:
        InputError: a key that seems to hold the lens or the size is none of those that are read.
        KeyError, TypeError, ValueError, OverflowError: a value is missing or invalid.
    """
    matrix = _matrix_in(values)
    if matrix is None:
        return None
    coefficients = _lens_in(path, values, fisheye)
    width, height = _size_in(path, values, size_px)
    return CameraIntrinsics(
        matrix, np.pad(coefficients, (0, max(0, 5 - len(coefficients)))), int(width), int(height)
    )


def _matrix_in(values: Mapping[str, Any]) -> FloatArray | None:
    """Return the (3, 3) camera matrix; None if the file has none."""
    if "intrinsic_matrix" in values:
        return np.array(values["intrinsic_matrix"], dtype=np.float64).reshape(3, 3).T
    if any(key in values for key in _MATRICES):
        return np.array(_data(_first(values, _MATRICES)), dtype=np.float64).reshape(3, 3)
    named = next((names for names in _FOCAL if names[0] in values), None)
    if named is None:
        return None
    fx, fy = (float(values[name]) for name in named)
    centre = next((names for names in _PRINCIPAL if names[0] in values), _PRINCIPAL[0])
    middle = COLMAP_MIDDLE if named == _FOCAL[1] else 0.0
    cx, cy = (float(values[name]) - middle for name in centre)
    return np.array([[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]])


def _lens_in(path: AnyPath, values: Mapping[str, Any], fisheye: bool) -> FloatArray:
    """Return the (N,) coefficients: a list, a matrix, or numbers named k1, p1 and so on."""
    given = _first(values, _LENSES)
    names = _FISHEYE_COEFFICIENTS if fisheye else _COEFFICIENTS
    if isinstance(given, Mapping) and any(name in given for name in names):
        values, given = given, None
    if given is not None:
        return np.array(_data(given), dtype=np.float64).reshape(-1)
    if any(name in values for name in names):
        return np.array([float(values.get(name, 0.0)) for name in names])
    for key, value in values.items():
        if _LIKE_A_LENS.search(key) and _has_numbers(value):
            raise InputError(
                f"The intrinsics file {path} has {key}, which is not read and may be its distortion; try the "
                "name distortion for k1, k2, p1, p2, k3, or leave it out if there is none"
            )
    return np.empty(0)


def _size_in(
    path: AnyPath, values: Mapping[str, Any], size_px: tuple[int, int] | None
) -> tuple[float, float]:
    """Return width and height of the file, or else those of the images."""
    width, height = _first(values, _WIDTHS), _first(values, _HEIGHTS)
    if width is not None and height is not None:
        return float(width), float(height)
    if size_px is None or width is not None or height is not None:
        raise KeyError("width")
    for key, value in values.items():
        if _LIKE_A_SIZE.search(key) and _has_numbers(value):
            numbers = set(np.ravel(_data(value)).astype(float).tolist())
            if not numbers <= set(map(float, size_px)):
                raise InputError(
                    f"The intrinsics file {path} has {key} {value}, but the images have {size_px[0]} x "
                    f"{size_px[1]} pixels; try the intrinsics of images of that size, with width and height"
                )
    return size_px


def _has_numbers(value: Any) -> bool:
    """Return whether a value is a number other than 0, or has such numbers."""
    if isinstance(value, bool):
        return False
    try:
        return bool(np.any(np.array(_data(value), dtype=np.float64)))
    except (KeyError, TypeError, ValueError):
        return False


def _first(values: Mapping[str, Any], keys: tuple[str, ...]) -> Any:
    return next((values[key] for key in keys if values.get(key) is not None), None)


def _data(value: Any) -> Any:
    """Return a list, or the data of a matrix after checking that they match its size."""
    if not isinstance(value, dict):
        return value
    numbers = value["data"]
    if "rows" in value and "cols" in value and len(numbers) != value["rows"] * value["cols"]:
        raise ValueError
    return numbers
