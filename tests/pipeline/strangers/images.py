"""Images, cameras and poses as the writers of recordings store them."""

from __future__ import annotations

import json
from pathlib import Path

import cv2
import numpy as np
from PIL import Image
from scipy.spatial.transform import Rotation

from pipeline.types import ByteArray, CameraIntrinsics, FloatArray, RgbdFrame

ARKIT = np.diag([1.0, -1.0, -1.0, 1.0])
"""From camera axes with z forward and y down to ARKit's, with z backward and y up."""


def save_color(path: Path, rgb: ByteArray) -> None:
    """Write a PNG, or a JPEG of quality 95, by the suffix."""
    path.parent.mkdir(parents=True, exist_ok=True)
    Image.fromarray(rgb).save(path, **({"quality": 95} if path.suffix == ".jpg" else {}))


def save_depth(path: Path, frame: RgbdFrame, units_per_metre: float = 1000.0, unknown: int = 0) -> None:
    """Write a 16-bit PNG."""
    path.parent.mkdir(parents=True, exist_ok=True)
    cv2.imwrite(str(path), depth_units(frame, units_per_metre, unknown))


def depth_units(frame: RgbdFrame, units_per_metre: float = 1000.0, unknown: int = 0) -> np.ndarray:
    """Return (H, W) uint16 depth."""
    known = frame.depth.valid
    units = np.rint(np.where(known, frame.depth.z_m, 0.0).astype(np.float64) * units_per_metre)
    return np.where(known, units, unknown).astype(np.uint16)


def photograph(frame: RgbdFrame, times: int) -> tuple[ByteArray, CameraIntrinsics]:
    """Return the colour image with ``times`` as many columns and rows, and its camera.

    The corners of both images see the same: their cx + 0.5 are in proportion.
    """
    K = frame.intrinsics
    cx, cy = ((c + 0.5) * times - 0.5 for c in (K.cx_px, K.cy_px))
    size = times * K.width_px, times * K.height_px
    rgb = np.repeat(np.repeat(frame.rgb, times, axis=0), times, axis=1)
    return rgb, CameraIntrinsics.pinhole(times * K.fx_px, times * K.fy_px, cx, cy, *size)


def quaternion(T: FloatArray) -> list[float]:
    """Return x, y, z, w of a (4, 4) transform's rotation."""
    return Rotation.from_matrix(T[:3, :3]).as_quat().tolist()


def text_of(values: FloatArray | list[float], digits: int = 7) -> str:
    """Return numbers separated by blanks."""
    return " ".join(f"{value:.{digits}f}" for value in np.ravel(values))


def save_open3d_camera(path: Path, camera: CameraIntrinsics) -> None:
    """Write Open3D's JSON, whose matrix is stored by columns."""
    values = {"width": camera.width_px, "height": camera.height_px}
    path.write_text(json.dumps(values | {"intrinsic_matrix": camera.matrix.T.ravel().tolist()}))


def save_opencv_camera(path: Path, camera: CameraIntrinsics) -> None:
    """Write the YAML of OpenCV's calibration sample."""
    file = cv2.FileStorage(str(path), cv2.FILE_STORAGE_WRITE)
    file.write("image_width", camera.width_px)
    file.write("image_height", camera.height_px)
    file.write("camera_matrix", camera.matrix)
    file.write("distortion_coefficients", np.zeros((5, 1)))
    file.release()
