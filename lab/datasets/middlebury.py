"""Middlebury 2014 stereo scenes, and the motorcycle scene that is part of scikit-image.

Scharstein et al., "High-resolution stereo datasets with subpixel-accurate ground truth", GCPR 2014.
"""

from __future__ import annotations

import re
import zipfile
from functools import partial
from pathlib import Path

import numpy as np

from lab.datasets.netpbm import read_netpbm
from lab.datasets.pair import Load, Pair
from packetmesh.errors import InputError
from packetmesh.files import read_text
from pipeline.io.images import read_color
from pipeline.types import CameraIntrinsics, FloatArray

_NUMBER = r"(-?[\d.]+(?:e[-+]?\d+)?)"


ARCHIVE, ARCHIVE_PICTURE = "motorcycle_disp.npz", "motorcycle_left.png"
MOTORCYCLE = (994.978, 0.193001, 31.086)
"""Focal length (pixels), baseline (metres) and offset (pixels) of the quarter-size images in scikit-image
(data.stereo_motorcycle)."""
MOTORCYCLE_CENTER_PX = (311.193, 254.877)
"""The left camera's principal point (x, y), from the same source."""


def find(root: Path) -> list[Load]:
    """Return the left views in ``root`` and all folders below it; each folder is a scene."""
    scenes = [file.parent for file in sorted(root.rglob("disp0.pfm"))]
    archives = sorted(root.rglob(ARCHIVE))
    return [
        *(partial(_load_scene, folder) for folder in scenes if _there(folder, "im0.png", "calib.txt")),
        *(partial(_load_motorcycle, file) for file in archives if _there(file.parent, ARCHIVE_PICTURE)),
    ]


def _there(folder: Path, *names: str) -> bool:
    return all((folder / name).is_file() for name in names)


def _load_scene(folder: Path) -> Pair:
    stereo = read_calibration(folder / "calib.txt")
    picture = folder / "im0.png"
    return Pair(picture, read_color(picture), depth_m(read_netpbm(folder / "disp0.pfm"), *stereo))


def _load_motorcycle(file: Path) -> Pair:
    try:
        with np.load(file) as arrays:
            disparity_px = arrays["arr_0"]
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile):
        raise InputError(f"The disparities {file} are damaged; try scikit-image's file again") from None
    picture = file.with_name(ARCHIVE_PICTURE)
    rgb, z_m = read_color(picture), depth_m(disparity_px, *MOTORCYCLE)
    focal_px, height, width = MOTORCYCLE[0], *z_m.shape
    camera = CameraIntrinsics.pinhole(focal_px, focal_px, *MOTORCYCLE_CENTER_PX, width, height)
    return Pair(picture, rgb, z_m, camera=camera)


def depth_m(disparity_px: FloatArray, focal_px: float, baseline_m: float, doffs_px: float) -> FloatArray:
    """Return (H, W) float32 metres; NaN where the disparity is not finite or gives no positive depth.

    Z = focal baseline / (disparity + doffs); doffs is the right minus the left principal point, along x.
    """
    shifted = np.asarray(disparity_px, np.float64) + doffs_px
    known = np.isfinite(disparity_px) & (shifted > 0)
    return (focal_px * baseline_m / np.where(known, shifted, np.nan)).astype(np.float32)


def read_calibration(file: Path) -> tuple[float, float, float]:
    """Return focal length in pixels, baseline in metres and offset in pixels of a ``calib.txt``.

    Raises:
        InputError: the file is missing, or lacks cam0, baseline or doffs.
    """
    text = read_text(file, "Middlebury calibration")
    patterns = (r"cam0\s*=\s*\[", r"baseline\s*=\s*", r"doffs\s*=\s*")
    focal, baseline, doffs = (re.search(rf"^{start}{_NUMBER}", text, re.M) for start in patterns)
    if not (focal and baseline and doffs):
        raise InputError(
            f"The calibration {file} has no cam0, baseline and doffs; try the calib.txt of Middlebury 2014"
        )
    return float(focal[1]), float(baseline[1]) / 1000.0, float(doffs[1])
