"""SUN RGB-D: one folder a frame, depth with its bits rotated by three.

Song et al., "SUN RGB-D: A RGB-D Scene Understanding Benchmark Suite", CVPR 2015.
"""

from __future__ import annotations

from functools import partial
from pathlib import Path

import numpy as np

from lab.datasets.pair import Load, Pair
from pipeline.io.images import read_color, read_depth
from pipeline.types import FloatArray

FARTHEST_M = 8.0
"""The set's toolbox (read3dPoints.m) caps depth here."""
DEPTH_FOLDERS = ("depth_bfx", "depth")
"""Depth merged from several frames where it is there, else the sensor's."""
UNITS_PER_METRE = 8000.0
"""Rotation by three bits makes an eighth of a millimetre of each unit below 8.192 m."""


def find(root: Path) -> list[Load]:
    """The frames in folders with image/ and depth_bfx/ or depth/, at any level below ``root``."""
    pairs: list[Load] = []
    for image in [root / "image", *sorted(root.rglob("*/image"))]:
        picture = next(iter(sorted(image.glob("*.jpg")) + sorted(image.glob("*.png"))), None)
        depths = [file for kind in DEPTH_FOLDERS for file in sorted((image.parent / kind).glob("*.png"))]
        if picture is not None and depths:
            pairs.append(partial(_load, picture, depths[0]))
    return pairs


def _load(picture: Path, depth: Path) -> Pair:
    z_m = decoded(read_depth(depth, UNITS_PER_METRE).z_m)
    capped_m = np.minimum(z_m, np.float32(FARTHEST_M))
    return Pair(picture, read_color(picture), capped_m, judged=~(z_m > FARTHEST_M))


def decoded(raw_m: FloatArray) -> FloatArray:
    """(H, W) depths in metres from those that were read as if the bits were not rotated."""
    known = np.isfinite(raw_m)
    units = np.rint(np.where(known, raw_m, 0.0).astype(np.float64) * UNITS_PER_METRE).astype(np.uint16)
    millimetres = (units >> 3) | (units << 13)
    return np.where(known, millimetres.astype(np.float32) / np.float32(1000.0), np.float32(np.nan))
