"""Pixels near known ones, and colours filled in from the nearest known pixel."""

from __future__ import annotations

import cv2
import numpy as np

from pipeline.types import BoolArray, ByteArray


def near(known: BoolArray, reach_px: float) -> BoolArray:
    """Return an (H, W) mask of the pixels that have a known one within ``reach_px``."""
    distance_px = cv2.distanceTransform((~known).astype(np.uint8), cv2.DIST_L2, 5)
    return distance_px <= reach_px


def nearest_colors(rgb: ByteArray, known: BoolArray) -> ByteArray:
    """Fill every unknown pixel with the colour of the nearest known one; unchanged if none is known."""
    if not known.any():
        return rgb
    _, labels = cv2.distanceTransformWithLabels(
        (~known).astype(np.uint8), cv2.DIST_L2, 5, labelType=cv2.DIST_LABEL_PIXEL
    )
    color_of = np.zeros((int(labels.max()) + 1, 3), np.uint8)
    color_of[labels[known]] = rgb[known]
    return color_of[labels]
