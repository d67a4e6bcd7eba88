"""The record of a detection in one image, and the brightness that detectors read."""

from __future__ import annotations

from dataclasses import dataclass, field

import cv2
import numpy as np

from pipeline.calibration.board import Board
from pipeline.types import ByteArray, FloatArray, IntArray


@dataclass(frozen=True, slots=True)
class Detection:
    """Points found in one image."""

    points_px: FloatArray
    """(N, 2) subpixel positions of the board's points; empty if the board was not found."""
    indices: IntArray
    """(N,) index of each point in ``Board.points_m``."""
    reason: str = ""
    """Sentence on the reason why the board was not found, with advice; empty if it was found."""
    blobs_px: FloatArray = field(default_factory=lambda: np.zeros((0, 2)))
    """(B, 2) circle-like blobs, if the board was not found."""
    oriented: bool = True
    """Whether a mark or the pattern showed the orientation; if not, all points may be rotated by 180°."""
    legacy: bool = False
    """Whether a ChArUco board has the layout of OpenCV before 4.6."""

    @property
    def found(self) -> bool:
        """Whether the board was found."""
        return len(self.points_px) > 0


def not_found(reason: str, blobs_px: FloatArray | None = None) -> Detection:
    """Return the record of an image in which no board was found, with the reason."""
    blobs_px = np.zeros((0, 2)) if blobs_px is None else blobs_px
    return Detection(np.zeros((0, 2)), np.zeros(0, np.int64), reason, blobs_px)


def whole(board: Board, points_px: FloatArray, oriented: bool) -> Detection:
    """Return the detection of all points of a board, in the board's order."""
    return Detection(points_px, np.arange(len(board.points_m)), oriented=oriented)


def brightness(gray: ByteArray, points_px: FloatArray) -> FloatArray:
    """Return (N,) interpolated grey levels at (N, 2) positions, 0 outside the image."""
    x, y = points_px.T.astype(np.float32)
    return cv2.remap(gray.astype(np.float32), x[None], y[None], cv2.INTER_LINEAR)[0]
