"""Conversion of any image to the network's input, and of its output to the image's grid (SPEC 3.2)."""

from __future__ import annotations

import cv2
import numpy as np

from pipeline.types import ByteArray, FloatArray

WIDTH_PX, HEIGHT_PX = 320, 240
"""Size into which a whole image is fitted."""
CROP_WIDTH_PX, CROP_HEIGHT_PX = 304, 228
"""Size into which the thesis's centre crop is fitted: 95 % of each side."""
PADDED_HEIGHT_PX = 256
"""Height of the network's input, 256 x 320: both sides are multiples of its stride 32."""
IMAGENET_MEAN = (0.485, 0.456, 0.406)
IMAGENET_DEVIATION = (0.229, 0.224, 0.225)
MEAN = np.array(IMAGENET_MEAN, np.float32)
STANDARD_DEVIATION = np.array(IMAGENET_DEVIATION, np.float32)
LONGEST_TIMES_SHORTEST = 3.0
"""Largest aspect ratio of an input of free size; a longer image loses resolution, which limits the memory."""


def fitted(rgb: ByteArray, width_px: int = WIDTH_PX, height_px: int = HEIGHT_PX) -> ByteArray:
    """Scale the image to fit into (height, width) with its aspect; averages areas when it shrinks."""
    rows, columns = rgb.shape[:2]
    scale = min(width_px / columns, height_px / rows)
    return resized(rgb, max(1, round(columns * scale)), max(1, round(rows * scale)))


def resized(rgb: ByteArray, width_px: int, height_px: int) -> ByteArray:
    """Stretch the image to (height, width); averages areas when it shrinks."""
    rows, columns = rgb.shape[:2]
    if (width_px, height_px) == (columns, rows):
        return rgb
    shrinks = width_px * height_px < columns * rows
    return cv2.resize(
        rgb, (width_px, height_px), interpolation=cv2.INTER_AREA if shrinks else cv2.INTER_LINEAR
    )


def free_size(columns: int, rows: int, shortest_px: int, multiple_px: int) -> tuple[int, int]:
    """Return width and height closest to the image's aspect, with the shorter side at least ``shortest_px``.

    Both are multiples of ``multiple_px`` (Depth Anything's ``Resize`` with ``lower_bound``), and the longer
    one is at most three times the shorter.
    """
    least = multiple_px * -(-shortest_px // multiple_px)
    most = multiple_px * int(LONGEST_TIMES_SHORTEST * least / multiple_px)
    scale = shortest_px / min(columns, rows)
    width, height = (multiple_px * round(side * scale / multiple_px) for side in (columns, rows))
    return min(max(width, least), most), min(max(height, least), most)


def padded(rgb: ByteArray, width_px: int, height_px: int) -> ByteArray:
    """Centre the image in (height, width) and pad it by reflection."""
    rows, columns = rgb.shape[:2]
    top, left = (height_px - rows) // 2, (width_px - columns) // 2
    return np.pad(
        rgb, ((top, height_px - rows - top), (left, width_px - columns - left), (0, 0)), mode="reflect"
    )


def normalised_input(rgb: ByteArray) -> FloatArray:
    """Convert (H, W, 3) uint8, at most 240 x 320, to our network's (1, 3, 256, 320) float32 input."""
    image = padded(rgb, WIDTH_PX, PADDED_HEIGHT_PX).astype(np.float32)
    scaled = (image / np.float32(255.0) - MEAN) / STANDARD_DEVIATION
    return np.ascontiguousarray(scaled.transpose(2, 0, 1)[None])


def unpad(padded: FloatArray, rows: int = HEIGHT_PX, columns: int = WIDTH_PX) -> FloatArray:
    """Return the central (rows, columns) of a network's output."""
    top, left = (padded.shape[0] - rows) // 2, (padded.shape[1] - columns) // 2
    return padded[top : top + rows, left : left + columns]


def centre_crop(rows: int, columns: int) -> tuple[slice, slice]:
    """Return rows and columns of the thesis's centre crop, 304/320 by 228/240 of any image."""
    height = round(rows * CROP_HEIGHT_PX / HEIGHT_PX)
    width = round(columns * CROP_WIDTH_PX / WIDTH_PX)
    top, left = (rows - height) // 2, (columns - width) // 2
    return slice(top, top + height), slice(left, left + width)
