"""A picture with its depth, and the promise of one that is read when it is needed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np

from packetmesh.errors import InputError
from pipeline.types import BoolArray, ByteArray, CameraIntrinsics, FloatArray

Part = Literal["train", "test"]


@dataclass(frozen=True, slots=True)
class Pair:
    """One picture and its true depth, on the same pixel grid."""

    name: str
    """``scene/frame``; frames of one scene show the same place."""
    rgb: ByteArray
    """(H, W, 3) RGB; grey pictures have three equal channels."""
    truth_m: FloatArray
    """(H, W) float32, metres along the optical axis, NaN where unknown."""
    intrinsics: CameraIntrinsics | None = None
    judged: BoolArray | None = None
    """(H, W) the pixels that this set's evaluations compare; None when all of them."""

    def __post_init__(self) -> None:
        """Raise InputError for depth of another size than the picture's."""
        if self.truth_m.shape != self.rgb.shape[:2]:
            picture, depth = (f"{w} x {h}" for h, w in (self.rgb.shape[:2], self.truth_m.shape))
            raise InputError(
                f"{self.name} has a picture of {picture} and depth of {depth} pixels; "
                "try the set's depth that is registered to its pictures"
            )


@dataclass(frozen=True, slots=True)
class Frame:
    """A pair that lies on disk."""

    name: str
    load: Callable[[], Pair]
    """Reads the files."""
    part: Part | None = None
    """Where the set's own split puts it; None when the set has none."""


def window(shape: tuple[int, ...], rows: slice, columns: slice) -> BoolArray:
    """(H, W) True inside the rows and columns."""
    mask = np.zeros(shape[:2], dtype=bool)
    mask[rows, columns] = True
    return mask
