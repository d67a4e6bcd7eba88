"""ViSP's castle recorded by an Intel RealSense SR300: grey images, and depth from a second camera.

ViSP's mbt-depth/castel (Debian visp-images-data), read as its tutorial-mb-generic-tracker-rgbd does.
"""

from __future__ import annotations

import re
from functools import partial
from pathlib import Path

import numpy as np

from lab.datasets.netpbm import read_netpbm
from lab.datasets.pair import Load, Pair
from packetmesh.errors import InputError
from packetmesh.files import MAX_IMAGE_BYTES, MAX_IMAGE_PIXELS, read_bytes, read_text
from pipeline.io.depth_to_color import carried
from pipeline.types import CameraIntrinsics, FloatArray

METRES_PER_UNIT = 0.000124986647
NEAREST_M = 0.1
"""Least valid depth; lower values are noise: the camera measures from 0.2 m."""
INVERSE_DISTORTION = (0.165056542, -0.0508309528, 0.00435937941, 0.00541406544, 0.250085592)
"""k1, k2, p1, p2, k3 of the depth camera, which map pixels to rays, not back (librealsense's inverse
Brown-Conrady); from the tutorial, as the set's own files lack them."""


def find(root: Path) -> list[Load]:
    """Return the frames next to every ``depth_M_color.txt`` at or below ``root``."""
    pairs: list[Load] = []
    for extrinsics in sorted(root.rglob("depth_M_color.txt")):
        for picture in sorted(extrinsics.parent.glob("*/image_*.pgm")):
            depth = picture.with_name(f"depth_{picture.stem}.bin")
            if depth.is_file():
                pairs.append(partial(_load, extrinsics, picture, depth))
    return pairs


def _load(extrinsics: Path, picture: Path, depth: Path) -> Pair:
    grey, z_m = read_netpbm(picture), read_depth_bin(depth)
    color_camera = _camera(extrinsics.with_name("chateau.xml"), grey.shape)
    depth_camera = _camera(extrinsics.with_name("chateau_depth.xml"), z_m.shape)
    truth_m = registered(z_m, depth_camera, color_camera, np.linalg.inv(_pose(extrinsics)))
    return Pair(picture, np.repeat(grey[..., None], 3, axis=2), truth_m, camera=color_camera)


def registered(
    z_m: FloatArray, depth_camera: CameraIntrinsics, color_camera: CameraIntrinsics, T_color_depth: FloatArray
) -> FloatArray:
    """Return (H, W) depth, metres, on the colour camera's pixels; NaN where no depth pixel is visible."""
    return carried(z_m, lambda pixels: rays(depth_camera, pixels), color_camera, T_color_depth)


def rays(camera: CameraIntrinsics, pixels: FloatArray) -> FloatArray:
    """Return (N, 3) directions with z = 1, in the depth camera's frame, of (N, 2) positions in its image."""
    k1, k2, p1, p2, k3 = INVERSE_DISTORTION
    x, y = ((pixels - (camera.cx_px, camera.cy_px)) / (camera.fx_px, camera.fy_px)).T
    r2 = x * x + y * y
    factor = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3))
    return np.stack(
        [
            x * factor + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x),
            y * factor + 2.0 * p2 * x * y + p1 * (r2 + 2.0 * y * y),
            np.ones_like(x),
        ],
        axis=1,
    )


def read_depth_bin(file: Path) -> FloatArray:
    """Return (H, W) float32 metres, NaN below ``NEAREST_M``.

    The file has 32-bit height and width, then 16-bit values in units of about 1/8 mm.

    Raises:
        InputError: the file is missing, or its length does not fit its height and width.
    """
    data = read_bytes(file, MAX_IMAGE_BYTES, "SR300 depth")
    height, width = np.frombuffer(data[:8].ljust(8, b"\0"), "<u4").tolist()
    if height * width > MAX_IMAGE_PIXELS or len(data) != 8 + 2 * height * width or not height * width:
        raise InputError(f"The SR300 depth {file} is truncated or damaged; try to unpack ViSP's images again")
    z_m = np.frombuffer(data, "<u2", height * width, 8).reshape(height, width) * METRES_PER_UNIT
    return np.where(z_m >= NEAREST_M, z_m, np.nan).astype(np.float32)


def _camera(file: Path, shape: tuple[int, ...]) -> CameraIntrinsics:
    text = read_text(file, "camera file")
    values = [re.search(rf"<{key}>\s*([\d.]+)\s*</{key}>", text) for key in ("px", "py", "u0", "v0")]
    if not all(values):
        raise InputError(
            f"The camera file {file} has no px, py, u0 and v0; try the one of ViSP's castel folder"
        )
    fx, fy, cx, cy = (float(value[1]) for value in values if value)
    return CameraIntrinsics.pinhole(fx, fy, cx, cy, shape[1], shape[0])


def _pose(file: Path) -> FloatArray:
    """Return (4, 4) T_depth_color."""
    try:
        return np.array(read_text(file, "extrinsics").split(), dtype=np.float64).reshape(4, 4)
    except ValueError:
        raise InputError(f"The extrinsics {file} are not a 4 x 4 matrix; try the file of ViSP") from None
