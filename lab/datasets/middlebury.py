"""Middlebury 2014 stereo scenes, and the motorcycle scene that is part of scikit-image.

Scharstein et al., "High-resolution stereo datasets with subpixel-accurate ground truth", GCPR 2014.
"""

from __future__ import annotations

import re
import zipfile
from dataclasses import dataclass
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


@dataclass(frozen=True, slots=True)
class Stereo:
    """The left camera of a rectified stereo pair, and what turns its disparities into depth."""

    focal_px: float
    center_px: tuple[float, float]
    """Principal point (x, y)."""
    baseline_m: float
    doffs_px: float
    """The right minus the left principal point, along x."""

    def pair(self, picture: Path, disparity_px: FloatArray) -> Pair:
        """Return the left image with the depth of its disparities and its camera.

        Args:
            picture: file of the left image.
            disparity_px: (H, W), not finite where unknown.
        """
        z_m = depth_m(disparity_px, self.focal_px, self.baseline_m, self.doffs_px)
        height, width = z_m.shape
        camera = CameraIntrinsics.pinhole(self.focal_px, self.focal_px, *self.center_px, width, height)
        return Pair(picture, read_color(picture), z_m, camera=camera)


ARCHIVE, ARCHIVE_PICTURE = "motorcycle_disp.npz", "motorcycle_left.png"
MOTORCYCLE = Stereo(994.978, (311.193, 254.877), 0.193001, 31.086)
"""Calibration of the quarter-size images in scikit-image (data.stereo_motorcycle)."""


def find(root: Path) -> list[Load]:
    """Return the left views in ``root`` and all folders below it; each folder is a scene."""
    scenes = [file.parent for file in sorted(root.rglob("disp0.pfm"))]
    archives = sorted(root.rglob(ARCHIVE))
    return [
        *(partial(_load_scene, folder) for folder in scenes if _has_files(folder, "im0.png", "calib.txt")),
        *(partial(_load_motorcycle, file) for file in archives if _has_files(file.parent, ARCHIVE_PICTURE)),
    ]


def _has_files(folder: Path, *names: str) -> bool:
    return all((folder / name).is_file() for name in names)


def _load_scene(folder: Path) -> Pair:
    stereo = read_calibration(folder / "calib.txt")
    return stereo.pair(folder / "im0.png", read_netpbm(folder / "disp0.pfm"))


def _load_motorcycle(file: Path) -> Pair:
    try:
        with np.load(file) as arrays:
            disparity_px = arrays["arr_0"]
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile):
        raise InputError(f"The disparities {file} are damaged; try scikit-image's file again") from None
    return MOTORCYCLE.pair(file.with_name(ARCHIVE_PICTURE), disparity_px)


def depth_m(disparity_px: FloatArray, focal_px: float, baseline_m: float, doffs_px: float) -> FloatArray:
    """Return (H, W) float32 metres; NaN where the disparity is not finite or gives no positive depth.

    Z = focal baseline / (disparity + doffs).
    """
    shifted = np.asarray(disparity_px, np.float64) + doffs_px
    known = np.isfinite(disparity_px) & (shifted > 0)
    return (focal_px * baseline_m / np.where(known, shifted, np.nan)).astype(np.float32)


def read_calibration(file: Path) -> Stereo:
    """Return the calibration in a ``calib.txt``; cam0 is ``[f 0 cx; 0 f cy; 0 0 1]``, in pixels.

    Raises:
        InputError: the file is missing, or lacks cam0, baseline or doffs.
    """
    text = read_text(file, "Middlebury calibration")
    left = re.search(rf"^cam0\s*=\s*\[{_NUMBER} +0 +{_NUMBER}; *0 +{_NUMBER} +{_NUMBER};", text, re.M)
    baseline, doffs = (re.search(rf"^{key}\s*=\s*{_NUMBER}", text, re.M) for key in ("baseline", "doffs"))
    if not (left and baseline and doffs):
        raise InputError(
            f"The calibration {file} has no cam0, baseline and doffs; try the calib.txt of Middlebury 2014"
        )
    focal_px, cx_px, _, cy_px = map(float, left.groups())
    return Stereo(focal_px, (cx_px, cy_px), float(baseline[1]) / 1000.0, float(doffs[1]))
