"""Reading and writing of camera intrinsics in common formats, recognised by their keys."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from typing import Any

import numpy as np

from packetmesh.errors import InputError
from packetmesh.files import atomic_path, json_object, read_text
from pipeline.io.camera_files import camera_in
from pipeline.io.camera_keys import camera_of_keys
from pipeline.io.lenses import FISHEYE, KNOWN, is_fisheye_name, is_known, lens_of
from pipeline.types import AnyPath, CameraIntrinsics, FloatArray

FOCAL_LENGTHS = (0.05, 100.0)
"""Least and largest focal length in image widths or heights: angles of view of 169 and half a degree."""
MOST_DISTORTION = 1e4
FOCAL_SD = "focal_sd"
"""Key of the focal lengths' standard error, as a share of them."""
_YAML_ENTRY = re.compile(r"^([ \t]*)(\w+):(.*(?:\n(?![ \t]*\w+:).*)*)", re.MULTILINE)
_FISHEYE = re.compile(r"\bequidistant\b|\bOPENCV_FISHEYE\b")
"""Words that name the lens of a file without a key for it."""
_OPENCV = ("", "SIMPLE_PINHOLE", "PINHOLE", "SIMPLE_RADIAL", "RADIAL", "OPENCV", "FULL_OPENCV")
"""Values of nerfstudio's camera_model whose lens is OpenCV's."""
_LIST = re.compile(r"\[[^\]]*\]")
_LIST_ITEM = re.compile(r"\s*-(\s|$)")
"""The first item of a block list, in contrast to a negative number."""
_WORDS = re.compile(r"\s*[^\s#%.-]")
"""A line that is neither empty nor a comment, a list item or the end of a document."""
_BETWEEN = re.compile(r"[,;\[\]()]")
"""Marks between the numbers of a bare matrix."""
_NUMBER = re.compile(r"(?<![\w.])[-+]?(?:\d++\.?\d*+|\.\d++)(?:[eE][-+]?\d++)?(?![\w.])")


def read_intrinsics(path: AnyPath, size_px: tuple[int, int] | None = None) -> CameraIntrinsics:
    """Read intrinsics from JSON, YAML or text.

    Formats: JSON and YAML with the keys of ``pipeline.io.camera_keys``: those of Open3D, ROS's camera_info,
    OpenCV, the RealSense SDK and nerfstudio; files of COLMAP, Kalibr and MATLAB (``camera_files``); or a
    bare matrix, 3 x 3 or 4 x 4 numbers, if the image size is known. Lenses: all of ``CameraIntrinsics``.

    Args:
        path: the file.
        size_px: width and height of the images, for a bare matrix or a file without a size.

    Raises:
        InputError: the file is unreadable, of no known format, or has impossible values.
    """
    text = read_text(path, "intrinsics file")
    numbers = _bare_numbers(text)
    if numbers is not None and numbers.size in (9, 16):
        return _in_matrix(path, numbers, size_px)
    is_json = text.lstrip().startswith("{")
    try:
        values = json_object(text, path, "intrinsics file") if is_json else _parse_yaml(text)
    except ValueError:
        raise _unknown(path) from None
    return camera_of_values(path, values, text, size_px)


def camera_of_values(
    path: AnyPath, values: dict[str, Any], text: str, size_px: tuple[int, int] | None
) -> CameraIntrinsics:
    """Return the camera of a file's keys and values, or else of its text, as ``read_intrinsics`` does.

    Raises:
        InputError: the format or the lens is unknown, or a value is impossible.
    """
    model = _model_in(values, text)
    try:
        camera = camera_of_keys(path, values, size_px, is_fisheye_name(model))
        found = (camera, model) if camera else camera_in(path, text, size_px)
    except (KeyError, TypeError, ValueError, IndexError, OverflowError):
        found = None
    if found is None:
        raise _unknown(path)
    camera = _with_lens(path, *found)
    check_camera(f"The intrinsics file {path}", camera)
    return camera


def _unknown(path: AnyPath) -> InputError:
    return InputError(
        f"The intrinsics file {path} has no known format; try JSON with width, height, fx, fy, cx and cy"
    )


def _model_in(values: dict[str, Any], text: str) -> str:
    """Return the name of the distortion model in a file of one camera; empty for OpenCV's.

    The keys of the name: ``distortion_model`` of ROS, ``model`` next to ``coeffs`` of the RealSense SDK,
    ``fisheye_model`` of OpenCV, ``is_fisheye`` of instant-ngp and ``camera_model`` of nerfstudio.
    """
    if 1 in (values.get("fisheye_model"), values.get("is_fisheye")):
        return FISHEYE
    named = values.get("distortion_model") or (values.get("model") if "coeffs" in values else None)
    if named:
        return str(named)
    if "fl_x" in values:
        model = str(values.get("camera_model") or "")
        return "" if model.upper() in _OPENCV else model
    return FISHEYE if _FISHEYE.search(text) else ""


def _with_lens(path: AnyPath, camera: CameraIntrinsics, model: str) -> CameraIntrinsics:
    """Return the camera with the lens that its file names, or that its number of coefficients tells.

    Raises:
        InputError: the lens is not supported.
    """
    lens = lens_of(model, camera.distortion)
    if lens is None:
        count = f"of {len(camera.distortion)} coefficients" if is_known(model) else ""
        what = " ".join(word for word in ("the distortion model", model, count) if word)
        raise InputError(f"The intrinsics file {path} has {what}; try a calibration with {KNOWN}")
    return replace(camera, distortion=lens, fisheye=is_fisheye_name(model))


def _bare_numbers(text: str) -> FloatArray | None:
    """Return the (N,) numbers of a text that has only numbers and comments; else None.

    The numbers are separated by blanks, commas, semicolons or brackets.
    """
    lines = (line.split("#")[0] for line in text.splitlines())
    try:
        return np.array(_BETWEEN.sub(" ", " ".join(lines)).split(), dtype=np.float64)
    except ValueError:
        return None


def _in_matrix(path: AnyPath, numbers: FloatArray, size_px: tuple[int, int] | None) -> CameraIntrinsics:
    """Return the camera of a 3 x 3 or 4 x 4 matrix given row by row."""
    side = 3 if numbers.size == 9 else 4
    matrix = numbers.reshape(side, side)[:3, :3]
    if not (np.isfinite(matrix).all() and matrix[0, 0] > 0 and matrix[1, 1] > 0 and matrix[2, 2] == 1):
        rows = "; ".join(" ".join(f"{value:g}" for value in row) for row in matrix)
        raise InputError(
            f"The intrinsics file {path} holds the matrix {rows}, no camera matrix; try fx 0 cx, "
            "0 fy cy, 0 0 1 in pixels, fx and fy positive"
        )
    if size_px is None:
        raise InputError(
            f"The intrinsics file {path} is a bare matrix and does not say for which size; try JSON with "
            "width, height, fx, fy, cx and cy"
        )
    camera = CameraIntrinsics(matrix.copy(), np.zeros(5), *size_px)
    check_camera(f"The intrinsics file {path}", camera)
    return camera


def read_focal_sd(path: AnyPath) -> float | None:
    """Read the focal lengths' standard error, as a share of them, from a file of ``write_intrinsics``.

    Returns:
        None if the file, which may be of another program, has none.

    Raises:
        InputError: the file cannot be read.
    """
    try:
        value = json.loads(read_text(path, "intrinsics file"))[FOCAL_SD]
    except (ValueError, KeyError, TypeError):
        return None
    return float(value) if isinstance(value, int | float) and 0.0 <= value < 1.0 else None


def write_intrinsics(path: AnyPath, intrinsics: CameraIntrinsics, focal_sd: float | None = None) -> None:
    """Write ``width height fx fy cx cy distortion`` as JSON, exact to the last bit; a fisheye is named.

    Args:
        path: the file.
        intrinsics: the camera.
        focal_sd: standard error of its focal lengths as a share of them, if it is known.

    Raises:
        InputError: the folder cannot be written.
    """
    values: dict[str, Any] = {
        "width": intrinsics.width_px,
        "height": intrinsics.height_px,
        "fx": intrinsics.fx_px,
        "fy": intrinsics.fy_px,
        "cx": intrinsics.cx_px,
        "cy": intrinsics.cy_px,
        "distortion": intrinsics.distortion.tolist(),
    }
    if intrinsics.fisheye:
        values["distortion_model"] = FISHEYE
    if focal_sd is not None:
        values[FOCAL_SD] = focal_sd
    with atomic_path(path) as sibling:
        sibling.write_text(json.dumps(values, indent=1, allow_nan=False) + "\n")


def _parse_yaml(text: str) -> dict[str, Any]:
    """Parse numbers and words of block-style YAML, two levels deep, which camera files do not exceed.

    Raises:
        ValueError: the text ends within a list or a name.
    """
    if text.count("[") != text.count("]"):
        raise ValueError
    values: dict[str, Any] = {}
    parent = ""
    for indent, key, body in _YAML_ENTRY.findall(text):
        numbers = [float(number) for number in _NUMBER.findall(body)]
        is_list = "[" in body or _LIST_ITEM.match(body) is not None
        if any(_WORDS.match(line) for line in _LIST.sub("", body).splitlines()[1:]):
            raise ValueError
        value = numbers if is_list else numbers[0] if numbers else body.strip().strip("\"'")
        if indent and isinstance(values.get(parent), dict):
            values[parent][key] = value
        elif not indent:
            parent = key
            values[key] = value if body.strip() and "!!" not in body else {}
    return values


def check_camera(name: str, camera: CameraIntrinsics) -> None:
    """Raise an InputError, which begins with ``name``, for impossible values."""

    def wrong(what: str, hint: str) -> InputError:
        return InputError(f"{name} has {what}; try {hint}")

    matrix = camera.matrix
    if not (np.isfinite(matrix).all() and np.isfinite(camera.distortion).all()):
        raise wrong("values that are not finite numbers", "to calibrate again")
    if camera.width_px < 1 or camera.height_px < 1:
        raise wrong(f"an image size of {camera.width_px} x {camera.height_px}", "the size of the images")
    if camera.fx_px <= 0 or camera.fy_px <= 0:
        raise wrong(f"focal lengths {camera.fx_px:g} and {camera.fy_px:g} px", "positive ones")
    if matrix[0, 1] or matrix[1, 0] or not np.array_equal(matrix[2], (0.0, 0.0, 1.0)):
        raise wrong("a matrix with skew or in the wrong order", "fx 0 cx, 0 fy cy, 0 0 1")
    narrowest, widest = FOCAL_LENGTHS
    for focal_px, size_px in ((camera.fx_px, camera.width_px), (camera.fy_px, camera.height_px)):
        if not narrowest * size_px <= focal_px <= widest * size_px:
            raise wrong(
                f"a focal length of {focal_px:g} px for {size_px} px, which no lens has",
                "the camera's own, in pixels",
            )
    if np.abs(camera.distortion).max() > MOST_DISTORTION:
        raise wrong(f"distortion of {np.abs(camera.distortion).max():g}", "to calibrate again")
    if not (0 <= camera.cx_px < camera.width_px and 0 <= camera.cy_px < camera.height_px):
        raise wrong(
            f"a principal point ({camera.cx_px:g}, {camera.cy_px:g}) outside the "
            f"{camera.width_px} x {camera.height_px} image",
            "the size at which the camera was calibrated",
        )
