"""Camera files of other programs: a writer for each, and readers for those that ``intrinsics`` does not read.

Principal points are converted between pixel conventions: the centre of the first pixel is (0, 0) here,
(0.5, 0.5) in COLMAP and (1, 1) in MATLAB.
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Mapping
from types import MappingProxyType

import numpy as np

from packetmesh.errors import InputError
from packetmesh.files import atomic_path
from pipeline.io.lenses import FISHEYE, ros_name
from pipeline.types import AnyPath, CameraIntrinsics

COLMAP_MIDDLE, MATLAB_MIDDLE = 0.5, 1.0
"""Coordinate of the first pixel's centre in COLMAP and in MATLAB, px."""
_COLMAP = re.compile(r"^\s*\d+\s+(PINHOLE|OPENCV|FULL_OPENCV|OPENCV_FISHEYE)\s+(.*)$", re.MULTILINE)
_COLMAP_NUMBERS = {"PINHOLE": 4, "OPENCV": 8, "FULL_OPENCV": 12, "OPENCV_FISHEYE": 8}
"""Number of parameters after the image size."""
_KALIBR = re.compile(r"^\s+(intrinsics|distortion_coeffs|resolution):\s*\[([^\]]*)\]", re.MULTILINE)
_KALIBR_MODEL = re.compile(r"^\s+distortion_model:\s*[\"']?(\w+)", re.MULTILINE)
_KALIBR_CAMERA = re.compile(r"^cam\d+:", re.MULTILINE)
_MATLAB = re.compile(
    r"^\s*(FocalLength|PrincipalPoint|ImageSize|RadialDistortion|TangentialDistortion)\s*[:=]\s*\[([^\]]*)\]",
    re.MULTILINE,
)


def opencv_yaml(camera: CameraIntrinsics) -> str:
    """Return the camera in the YAML of ``cv2.FileStorage``; a fisheye has the key of OpenCV's sample."""
    return "\n".join(
        (
            "%YAML:1.0",
            "---",
            f"image_width: {camera.width_px}",
            f"image_height: {camera.height_px}",
            *(("fisheye_model: 1",) if camera.fisheye else ()),
            *opencv_matrix("camera_matrix", camera.matrix),
            *opencv_matrix("distortion_coefficients", camera.distortion[None]),
            "",
        )
    )


def opencv_matrix(name: str, values: np.ndarray) -> tuple[str, ...]:
    """Return the lines of a matrix in OpenCV's YAML."""
    rows, columns = values.shape
    return (
        f"{name}: !!opencv-matrix",
        f"   rows: {rows}",
        f"   cols: {columns}",
        "   dt: d",
        f"   data: [{listed(values.ravel())}]",
    )


def ros_matrix(name: str, values: np.ndarray) -> tuple[str, ...]:
    """Return the lines of a matrix in ROS's YAML."""
    rows, columns = values.shape
    return f"{name}:", f"  rows: {rows}", f"  cols: {columns}", f"  data: [{listed(values.ravel())}]"


def camera_info(camera: CameraIntrinsics) -> str:
    """Return the camera as ROS's camera_info, as ``camera_calibration`` writes it."""
    return "\n".join(
        (
            f"image_width: {camera.width_px}",
            f"image_height: {camera.height_px}",
            "camera_name: camera",
            *ros_matrix("camera_matrix", camera.matrix),
            f"distortion_model: {ros_name(camera)}",
            *ros_matrix("distortion_coefficients", camera.distortion[None]),
            *ros_matrix("rectification_matrix", np.eye(3)),
            *ros_matrix("projection_matrix", np.column_stack([camera.matrix, np.zeros(3)])),
            "",
        )
    )


def open3d_json(camera: CameraIntrinsics) -> str:
    """Return the camera as Open3D's PinholeCameraIntrinsic: column-major matrix, no distortion.

    Raises:
        InputError: the camera has distortion: its images must be undistorted first.
    """
    _refuse(camera, camera.fisheye or camera.distortion, "Open3D's file", "undistort the images first")
    values = {
        "width": camera.width_px,
        "height": camera.height_px,
        "intrinsic_matrix": camera.matrix.T.ravel().tolist(),
    }
    return json.dumps(values, indent=1) + "\n"


def colmap_text(camera: CameraIntrinsics) -> str:
    """Return a cameras.txt with one camera: OPENCV, FULL_OPENCV with k3 or more, or OPENCV_FISHEYE.

    Raises:
        InputError: the lens has a thin prism or a tilted sensor.
    """
    _refuse(camera, camera.distortion[8:], "COLMAP's file", "calibrate with the lens 'rational'")
    places = (camera.fx_px, camera.fy_px, camera.cx_px + COLMAP_MIDDLE, camera.cy_px + COLMAP_MIDDLE)
    whole = bool(np.any(camera.distortion[4:]))
    lens = np.pad(camera.distortion, (0, 3))[: 8 if whole else 4]
    model = "OPENCV_FISHEYE" if camera.fisheye else "FULL_OPENCV" if whole else "OPENCV"
    numbers = (*places, *lens)
    return (
        "# CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS[]\n"
        f"1 {model} {camera.width_px} {camera.height_px} {listed(np.array(numbers), ' ')}\n"
    )


def kalibr_yaml(camera: CameraIntrinsics) -> str:
    """Return Kalibr's camchain of one camera: equidistant if a fisheye, else radtan, which has no k3.

    Raises:
        InputError: k3 or a later coefficient is not 0.
    """
    _refuse(camera, camera.distortion[4:], "Kalibr's radtan", "calibrate with the lens 'thesis'")
    places = np.array([camera.fx_px, camera.fy_px, camera.cx_px, camera.cy_px])
    return (
        "cam0:\n  camera_model: pinhole\n"
        f"  intrinsics: [{listed(places)}]\n"
        f"  distortion_model: {'equidistant' if camera.fisheye else 'radtan'}\n"
        f"  distortion_coeffs: [{listed(camera.distortion[:4])}]\n"
        f"  resolution: [{camera.width_px}, {camera.height_px}]\n"
    )


def matlab_text(camera: CameraIntrinsics) -> str:
    """Return the properties of MATLAB's cameraIntrinsics, one per line.

    Raises:
        InputError: the lens is rational or a fisheye.
    """
    _refuse(
        camera, camera.fisheye or camera.distortion[5:], "MATLAB's file", "calibrate with the lens 'brown'"
    )
    k1, k2, p1, p2, k3 = camera.distortion[:5]
    middle = np.array([camera.cx_px, camera.cy_px]) + MATLAB_MIDDLE
    radial = (k1, k2, k3) if k3 else (k1, k2)
    return (
        f"FocalLength: [{listed(np.array([camera.fx_px, camera.fy_px]), ' ')}]\n"
        f"PrincipalPoint: [{listed(middle, ' ')}]\n"
        f"ImageSize: [{camera.height_px} {camera.width_px}]\n"
        f"RadialDistortion: [{listed(np.array(radial), ' ')}]\n"
        f"TangentialDistortion: [{listed(np.array([p1, p2]), ' ')}]\n"
    )


WRITERS: Mapping[str, Callable[[CameraIntrinsics], str]] = MappingProxyType(
    {
        "camera.yaml": opencv_yaml,
        "camera_info.yaml": camera_info,
        "open3d.json": open3d_json,
        "cameras.txt": colmap_text,
        "camchain.yaml": kalibr_yaml,
        "matlab.txt": matlab_text,
    }
)
"""Writers by the usual name of the file."""


def write_camera(path: AnyPath, camera: CameraIntrinsics, kind: str) -> None:
    """Write a camera with the writer ``WRITERS[kind]``.

    Raises:
        InputError: the format cannot store the distortion, or the folder cannot be written.
    """
    text = WRITERS[kind](camera)
    with atomic_path(path) as sibling:
        sibling.write_text(text)


def camera_in(
    path: AnyPath, text: str, size_px: tuple[int, int] | None
) -> tuple[CameraIntrinsics, str] | None:
    """Read a COLMAP, Kalibr or MATLAB camera and the name of its distortion model; None for other texts.

    Of several cameras it is the one for images of the size ``size_px``, or else the first.

    Raises:
        InputError: several different cameras in the file have images of the size ``size_px``.
        ValueError: numbers are missing.
    """
    for read in (_from_colmap, _from_kalibr, _from_matlab):
        found = read(text)
        fitting = [one for one in found if (one[0].width_px, one[0].height_px) == size_px]
        if any(not _same(one, fitting[0]) for one in fitting):
            first, _ = fitting[0]
            raise InputError(
                f"The intrinsics file {path} has {len(fitting)} cameras for images of "
                f"{first.width_px} x {first.height_px} pixels; try a file with only the camera of "
                "these images"
            )
        if found:
            return (fitting or found)[0]
    return None


def _same(one: tuple[CameraIntrinsics, str], other: tuple[CameraIntrinsics, str]) -> bool:
    (camera, model), (other_camera, other_model) = one, other
    return (
        model == other_model
        and np.array_equal(camera.matrix, other_camera.matrix)
        and np.array_equal(camera.distortion, other_camera.distortion)
    )


def _from_colmap(text: str) -> list[tuple[CameraIntrinsics, str]]:
    cameras = []
    for model, words in _COLMAP.findall(text):
        width, height, *numbers = (float(word) for word in words.split())
        if len(numbers) != _COLMAP_NUMBERS[model]:
            raise ValueError
        fx, fy, cx, cy, *lens = numbers
        camera = _camera((fx, fy, cx - COLMAP_MIDDLE, cy - COLMAP_MIDDLE), lens, width, height)
        cameras.append((camera, FISHEYE if model == "OPENCV_FISHEYE" else ""))
    return cameras


def _from_kalibr(text: str) -> list[tuple[CameraIntrinsics, str]]:
    cameras = []
    for part in _KALIBR_CAMERA.split(text):
        found = {name: _numbers(words) for name, words in _KALIBR.findall(part)}
        if {"intrinsics", "resolution"} <= found.keys():
            width, height = found["resolution"]
            camera = _camera(found["intrinsics"], found.get("distortion_coeffs", []), width, height)
            model = _KALIBR_MODEL.search(part)
            cameras.append((camera, model[1] if model else ""))
    return cameras


def _from_matlab(text: str) -> list[tuple[CameraIntrinsics, str]]:
    found = {name: _numbers(words) for name, words in _MATLAB.findall(text)}
    if not {"FocalLength", "PrincipalPoint", "ImageSize"} <= found.keys():
        return []
    if "Distortion" in text and not {"RadialDistortion", "TangentialDistortion"} <= found.keys():
        return []  # the file is truncated
    k1, k2, k3 = (*found.get("RadialDistortion", []), 0.0, 0.0, 0.0)[:3]
    p1, p2 = (*found.get("TangentialDistortion", []), 0.0, 0.0)[:2]
    cx, cy = (value - MATLAB_MIDDLE for value in found["PrincipalPoint"])
    height, width = found["ImageSize"]
    return [(_camera((*found["FocalLength"], cx, cy), [k1, k2, p1, p2, k3], width, height), "")]


def _camera(
    places: tuple[float, ...] | list[float], lens: list[float], width: float, height: float
) -> CameraIntrinsics:
    fx, fy, cx, cy = places
    coefficients = np.array([*lens, *[0.0] * (5 - len(lens))])
    matrix = np.array([[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]])
    return CameraIntrinsics(matrix, coefficients, int(width), int(height))


def _numbers(words: str) -> list[float]:
    return [float(word) for word in re.split(r"[\s,;]+", words.strip()) if word]


def listed(values: np.ndarray, between: str = ", ") -> str:
    """Format numbers exactly to the last bit."""
    return between.join(repr(float(value)) for value in values)


def _refuse(camera: CameraIntrinsics, lens: np.ndarray | bool, what: str, instead: str) -> None:
    if np.any(lens):
        values = ", ".join(f"{value:.4g}" for value in camera.distortion)
        names = "a fisheye of k1, k2, k3, k4" if camera.fisheye else "k1, k2, p1, p2, k3"
        names += ", k4 and so on" if len(camera.distortion) > 5 else ""
        raise InputError(f"{what} cannot hold {names} = {values}; {instead}")
