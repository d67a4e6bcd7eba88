"""An image with its depth, and the type of functions that read one."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from packetmesh.errors import InputError
from pipeline.io.images import read_color, read_depth
from pipeline.types import BoolArray, ByteArray, CameraIntrinsics, FloatArray


@dataclass(frozen=True, slots=True)
class Pair:
    """One image and its true depth, on the same pixel grid."""

    picture: Path
    """Path of the image; for one of many images in a file, the file's path and the image's number."""
    rgb: ByteArray
    """(H, W, 3) RGB; grey images have three equal channels."""
    truth_m: FloatArray
    """(H, W) float32, metres along the optical axis, NaN where unknown."""
    judged: BoolArray | None = None
    """(H, W) True at the pixels that this set's evaluations use; None for all pixels."""
    camera: CameraIntrinsics | None = None
    """Camera of the image; None if the set's reader does not know it."""

    def __post_init__(self) -> None:
        """Raise InputError for depth of another size than the picture's."""
        if self.truth_m.shape != self.rgb.shape[:2]:
            picture, depth = (f"{w} x {h}" for h, w in (self.rgb.shape[:2], self.truth_m.shape))
            raise InputError(
                f"{self.picture} has a picture of {picture} and depth of {depth} pixels; "
                "try the set's depth that is registered to its pictures"
            )


Load = Callable[[], Pair]
"""Reads the files of a pair; raises an InputError if one is unusable."""


def load_pair(picture: Path, depth: Path, units_per_metre: float = 1000.0) -> Pair:
    """Return an image with its 16-bit depth image, whose value 0 means unknown.

    Raises:
        InputError: one of them cannot be read, or they differ in size.
    """
    return Pair(picture, read_color(picture), read_depth(depth, units_per_metre).z_m)


def window(shape: tuple[int, ...], rows: slice, columns: slice) -> BoolArray:
    """Return (H, W) True inside the rows and columns."""
    mask = np.zeros(shape[:2], dtype=bool)
    mask[rows, columns] = True
    return mask
