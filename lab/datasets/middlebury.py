"""Middlebury 2014 stereo scenes, also the motorcycle that scikit-image carries.

Scharstein et al., "High-resolution stereo datasets with subpixel-accurate ground truth", GCPR 2014.
"""

from __future__ import annotations

import re
import zipfile
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

from lab.datasets.pair import Frame, Pair
from packetmesh.errors import InputError
from packetmesh.files import MAX_IMAGE_BYTES, MAX_IMAGE_PIXELS, read_bytes, read_text
from pipeline.io.images import read_color
from pipeline.types import CameraIntrinsics, FloatArray

_HEADER = re.compile(rb"Pf\s+(\d+)\s+(\d+)\s+(-?\d+(?:\.\d*)?)\s")
_NUMBER = r"(-?[\d.]+(?:e[-+]?\d+)?)"


@dataclass(frozen=True, slots=True)
class Stereo:
    """What turns a disparity into a depth: Z = focal baseline / (disparity + doffs)."""

    focal_px: float
    cx_px: float
    cy_px: float
    baseline_m: float
    doffs_px: float
    """Difference of the two principal points."""

    def depth_m(self, disparity_px: FloatArray) -> FloatArray:
        """(H, W) float32 metres; NaN where the disparity is not finite or nothing lies in front."""
        shifted = np.asarray(disparity_px, np.float64) + self.doffs_px
        known = np.isfinite(disparity_px) & (shifted > 0)
        z_m = self.focal_px * self.baseline_m / np.where(known, shifted, np.nan)
        return z_m.astype(np.float32)


ARCHIVE, ARCHIVE_PICTURE = "motorcycle_disp.npz", "motorcycle_left.png"
MOTORCYCLE = Stereo(994.978, 311.193, 254.877, 0.193001, 31.086)
"""Of the quarter-size pictures in scikit-image (data.stereo_motorcycle)."""


def find(root: Path) -> list[Frame]:
    """The left views in ``root`` and all folders below it, each folder a scene."""
    frames = []
    for file in sorted(root.rglob("disp0.pfm")):
        folder = file.parent
        if (folder / "im0.png").is_file() and (folder / "calib.txt").is_file():
            name = f"{folder.resolve().name}/im0"
            frames.append(Frame(name, partial(_load_scene, name, folder)))
    archives = [file for file in root.rglob(ARCHIVE) if file.with_name(ARCHIVE_PICTURE).is_file()]
    return frames + [Frame("motorcycle/left", partial(_load_motorcycle, file)) for file in sorted(archives)]


def _load_scene(name: str, folder: Path) -> Pair:
    stereo = read_calibration(folder / "calib.txt")
    return _pair(name, folder / "im0.png", read_pfm(folder / "disp0.pfm"), stereo)


def _load_motorcycle(file: Path) -> Pair:
    try:
        with np.load(file) as arrays:
            disparity_px = arrays["arr_0"]
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile):
        raise InputError(f"The disparities {file} are damaged; try scikit-image's file again") from None
    return _pair("motorcycle/left", file.with_name(ARCHIVE_PICTURE), disparity_px, MOTORCYCLE)


def _pair(name: str, picture: Path, disparity_px: FloatArray, stereo: Stereo) -> Pair:
    rgb = read_color(picture)
    height, width = rgb.shape[:2]
    camera = (stereo.focal_px, stereo.focal_px, stereo.cx_px, stereo.cy_px)
    return Pair(name, rgb, stereo.depth_m(disparity_px), CameraIntrinsics.pinhole(*camera, width, height))


def read_calibration(file: Path) -> Stereo:
    """The left camera and the baseline of a ``calib.txt``.

    Raises:
        InputError: missing, or without cam0, baseline and doffs.
    """
    text = read_text(file, "Middlebury calibration")
    pattern = rf"cam0\s*=\s*\[{_NUMBER} 0 {_NUMBER}; 0 {_NUMBER} {_NUMBER}; 0 0 1\]"
    camera = re.search(pattern, text)
    baseline, doffs = (re.search(rf"^{key}\s*=\s*{_NUMBER}", text, re.M) for key in ("baseline", "doffs"))
    if not (camera and baseline and doffs):
        raise InputError(
            f"The calibration {file} has no cam0, baseline and doffs; try the calib.txt of Middlebury 2014"
        )
    focal, cx, _, cy = map(float, camera.groups())
    return Stereo(focal, cx, cy, float(baseline[1]) / 1000.0, float(doffs[1]))


def read_pfm(file: Path) -> FloatArray:
    """(H, W) float32 of a grey PFM file, whose rows run from the bottom up.

    Raises:
        InputError: missing, truncated, too large, or no grey PFM.
    """
    data = read_bytes(file, MAX_IMAGE_BYTES, "disparity image")
    header = _HEADER.match(data)
    if header is None:
        raise InputError(f"The disparity image {file} is no grey PFM file; try Middlebury's disp0.pfm")
    width, height, scale = int(header[1]), int(header[2]), float(header[3])
    if width * height > MAX_IMAGE_PIXELS or len(data) < header.end() + 4 * width * height:
        raise InputError(
            f"The disparity image {file} is truncated or too large for its {width} x {height} pixels; "
            "try to copy it again"
        )
    order = "<f4" if scale < 0 else ">f4"
    values = np.frombuffer(data, order, width * height, header.end()).reshape(height, width)
    return values[::-1].astype(np.float32)
