"""From any image to the network's input and back to the image's grid (SPEC 3.2)."""

from __future__ import annotations

import cv2
import numpy as np

from pipeline.types import ByteArray, FloatArray

WIDTH_PX, HEIGHT_PX = 320, 240
"""Size a whole image is fitted into."""
CROP_WIDTH_PX, CROP_HEIGHT_PX = 304, 228
"""Size the thesis's centre crop is fitted into: 95 % of each side."""
PADDED_HEIGHT_PX = 256
"""The network's input is 256 x 320: both sides are multiples of its stride 32."""
MEAN = np.array([0.485, 0.456, 0.406], np.float32)
STANDARD_DEVIATION = np.array([0.229, 0.224, 0.225], np.float32)


def fitted(rgb: ByteArray, width_px: int = WIDTH_PX, height_px: int = HEIGHT_PX) -> ByteArray:
    """The image scaled to fit into (height, width) with its aspect kept; area averaging when it shrinks."""
    rows, columns = rgb.shape[:2]
    scale = min(width_px / columns, height_px / rows)
    size = max(1, round(columns * scale)), max(1, round(rows * scale))
    if size == (columns, rows):
        return rgb
    return cv2.resize(rgb, size, interpolation=cv2.INTER_AREA if scale < 1 else cv2.INTER_LINEAR)


def normalised_input(rgb: ByteArray) -> FloatArray:
    """(H, W, 3) uint8, at most 240 x 320, to the network's (1, 3, 256, 320) float32, reflect-padded."""
    rows, columns = rgb.shape[:2]
    top, left = (PADDED_HEIGHT_PX - rows) // 2, (WIDTH_PX - columns) // 2
    padding = ((top, PADDED_HEIGHT_PX - rows - top), (left, WIDTH_PX - columns - left), (0, 0))
    padded = np.pad(rgb, padding, mode="reflect").astype(np.float32)
    scaled = (padded / np.float32(255.0) - MEAN) / STANDARD_DEVIATION
    return np.ascontiguousarray(scaled.transpose(2, 0, 1)[None])


def unpad(padded: FloatArray, rows: int = HEIGHT_PX, columns: int = WIDTH_PX) -> FloatArray:
    """The (rows, columns) middle of the network's (256, 320) output."""
    top, left = (PADDED_HEIGHT_PX - rows) // 2, (WIDTH_PX - columns) // 2
    return padded[top : top + rows, left : left + columns]


def centre_crop(rows: int, columns: int) -> tuple[slice, slice]:
    """Rows and columns of the thesis's centre crop, 304/320 by 228/240 of any image."""
    height = round(rows * CROP_HEIGHT_PX / HEIGHT_PX)
    width = round(columns * CROP_WIDTH_PX / WIDTH_PX)
    top, left = (rows - height) // 2, (columns - width) // 2
    return slice(top, top + height), slice(left, left + width)
