"""SUN RGB-D: one folder per frame, depth with its bits rotated by three.

Song et al., "SUN RGB-D: A RGB-D Scene Understanding Benchmark Suite", CVPR 2015.
"""

from __future__ import annotations

from functools import partial
from pathlib import Path

import numpy as np

from lab.datasets.pair import Load, Pair
from pipeline.importing.depth_units import unrotated
from pipeline.io.images import read_color, read_depth_units

FARTHEST_M = 8.0
"""The set's toolbox (read3dPoints.m) caps depth here."""
DEPTH_FOLDERS = ("depth_bfx", "depth")
"""Folders of depth by preference: merged from several frames, then of a single frame."""


def find(root: Path) -> list[Load]:
    """Return the frames in folders with image/ and depth_bfx/ or depth/, at any level below ``root``."""
    pairs: list[Load] = []
    for image in [root / "image", *sorted(root.rglob("*/image"))]:
        picture = next(iter(sorted(image.glob("*.jpg")) + sorted(image.glob("*.png"))), None)
        depths = [file for kind in DEPTH_FOLDERS for file in sorted((image.parent / kind).glob("*.png"))]
        if picture is not None and depths:
            pairs.append(partial(_load, picture, depths[0]))
    return pairs


def _load(picture: Path, depth: Path) -> Pair:
    """Return a pair; depth beyond ``FARTHEST_M`` is unknown."""
    z_m = unrotated(read_depth_units(depth)) / np.float32(1000.0)
    known = (z_m > 0.0) & (z_m <= FARTHEST_M)
    return Pair(picture, read_color(picture), np.where(known, z_m, np.float32(np.nan)))
