"""SUN RGB-D: one folder a frame, depth with its bits rotated by three.

Song et al., "SUN RGB-D: A RGB-D Scene Understanding Benchmark Suite", CVPR 2015.
"""

from __future__ import annotations

from functools import partial
from pathlib import Path

import numpy as np

from lab.datasets.pair import Frame, Pair
from packetmesh.errors import InputError
from packetmesh.files import read_text
from pipeline.io.images import read_color, read_depth
from pipeline.types import CameraIntrinsics, FloatArray

FARTHEST_M = 8.0
"""The set's toolbox (read3dPoints.m) caps depth here."""
DEPTH_FOLDERS = ("depth_bfx", "depth")
"""Depth merged from several frames where it is there, else the sensor's."""
UNITS_PER_METRE = 8000.0
"""Rotation by three bits makes an eighth of a millimetre of each unit below 8.192 m."""


def find(root: Path) -> list[Frame]:
    """The frames in folders with image/ and depth_bfx/ or depth/, at any level below ``root``.

    The set does not say which frames show one place, so all frames of one folder count as one scene.
    """
    frames = []
    for image in [root / "image", *sorted(root.rglob("*/image"))]:
        picture = next(iter(sorted(image.glob("*.jpg")) + sorted(image.glob("*.png"))), None)
        depths = [file for kind in DEPTH_FOLDERS for file in sorted((image.parent / kind).glob("*.png"))]
        if picture is not None and depths:
            folder = image.parent.relative_to(root).as_posix()
            name = root.resolve().name if folder == "." else folder
            frames.append(Frame(name, partial(_load, name, picture, depths[0])))
    return frames


def _load(name: str, picture: Path, depth: Path) -> Pair:
    rgb, z_m = read_color(picture), decoded(read_depth(depth, UNITS_PER_METRE).z_m)
    intrinsics = _intrinsics(depth.parents[1] / "intrinsics.txt", rgb.shape)
    capped = np.minimum(z_m, np.float32(FARTHEST_M))
    return Pair(name, rgb, capped, intrinsics, judged=~(z_m > FARTHEST_M))


def decoded(raw_m: FloatArray) -> FloatArray:
    """(H, W) depths in metres from those that were read as if the bits were not rotated."""
    known = np.isfinite(raw_m)
    units = np.rint(np.where(known, raw_m, 0.0).astype(np.float64) * UNITS_PER_METRE).astype(np.uint16)
    millimetres = (units >> 3) | (units << 13)
    return np.where(known, millimetres.astype(np.float32) / np.float32(1000.0), np.float32(np.nan))


def _intrinsics(file: Path, shape: tuple[int, ...]) -> CameraIntrinsics | None:
    """The nine numbers of the camera matrix, row by row; None without the file."""
    if not file.is_file():
        return None
    try:
        matrix = np.array(read_text(file, "intrinsics file").split(), dtype=np.float64).reshape(3, 3)
    except ValueError:
        raise InputError(
            f"The intrinsics file {file} does not have nine numbers; try the one of SUN RGB-D"
        ) from None
    height, width = shape[:2]
    (fx, _, cx), (_, fy, cy) = matrix[:2]
    return CameraIntrinsics.pinhole(fx, fy, cx, cy, width, height)
