"""Writers of fisheye cameras for other programs that support the Kannala-Brandt model.

MATLAB's and Open3D's files have no such model, and neither do PacketMesh's own intrinsics.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType

import numpy as np

from packetmesh.files import atomic_path
from pipeline.io.camera_files import COLMAP_MIDDLE, listed, opencv_matrix, ros_matrix
from pipeline.types import AnyPath, FloatArray


def opencv_yaml(matrix: FloatArray, distortion: FloatArray, size_px: tuple[int, int]) -> str:
    """Return the camera in YAML, marked as a fisheye as in OpenCV's calibration sample."""
    return "\n".join(
        (
            "%YAML:1.0",
            "---",
            f"image_width: {size_px[0]}",
            f"image_height: {size_px[1]}",
            "fisheye_model: 1",
            *opencv_matrix("camera_matrix", matrix),
            *opencv_matrix("distortion_coefficients", distortion[None]),
            "",
        )
    )


def camera_info(matrix: FloatArray, distortion: FloatArray, size_px: tuple[int, int]) -> str:
    """Return ROS's camera_info with the distortion model ``equidistant``."""
    return "\n".join(
        (
            f"image_width: {size_px[0]}",
            f"image_height: {size_px[1]}",
            "camera_name: camera",
            *ros_matrix("camera_matrix", matrix),
            "distortion_model: equidistant",
            *ros_matrix("distortion_coefficients", distortion[None]),
            *ros_matrix("rectification_matrix", np.eye(3)),
            *ros_matrix("projection_matrix", np.column_stack([matrix, np.zeros(3)])),
            "",
        )
    )


def kalibr_yaml(matrix: FloatArray, distortion: FloatArray, size_px: tuple[int, int]) -> str:
    """Return Kalibr's camchain of one camera with the distortion model equidistant."""
    return (
        "cam0:\n  camera_model: pinhole\n"
        f"  intrinsics: [{listed(_places(matrix))}]\n"
        "  distortion_model: equidistant\n"
        f"  distortion_coeffs: [{listed(distortion)}]\n"
        f"  resolution: [{size_px[0]}, {size_px[1]}]\n"
    )


def colmap_text(matrix: FloatArray, distortion: FloatArray, size_px: tuple[int, int]) -> str:
    """Return a cameras.txt with one OPENCV_FISHEYE camera."""
    fx, fy, cx, cy = _places(matrix)
    numbers = listed(np.array([fx, fy, cx + COLMAP_MIDDLE, cy + COLMAP_MIDDLE, *distortion]), " ")
    return (
        f"# CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS[]\n1 OPENCV_FISHEYE {size_px[0]} {size_px[1]} {numbers}\n"
    )


FISHEYE_WRITERS: Mapping[str, Callable[[FloatArray, FloatArray, tuple[int, int]], str]] = MappingProxyType(
    {
        "camera.yaml": opencv_yaml,
        "camera_info.yaml": camera_info,
        "cameras.txt": colmap_text,
        "camchain.yaml": kalibr_yaml,
    }
)
"""Writers by the usual name of the file; arguments: (3, 3) K, (4,) k1 to k4, and width and height."""


def write_fisheye(
    path: AnyPath, matrix: FloatArray, distortion: FloatArray, size_px: tuple[int, int], kind: str
) -> None:
    """Write a camera with the writer ``FISHEYE_WRITERS[kind]``.

    Raises:
        InputError: the folder cannot be written.
    """
    with atomic_path(path) as sibling:
        sibling.write_text(FISHEYE_WRITERS[kind](matrix, distortion.ravel(), size_px))


def _places(matrix: FloatArray) -> FloatArray:
    return np.array([matrix[0, 0], matrix[1, 1], matrix[0, 2], matrix[1, 2]])
