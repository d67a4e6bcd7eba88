"""Baselines that fill depth without a network: inpainting, nearest depth, joint bilateral filtering.

The Hide tool compares the network's depth with them.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import cv2
import numpy as np

from packetmesh.errors import InputError
from pipeline.types import ByteArray, DepthMap, FloatArray

INPAINT_RADIUS_PX = 5.0
FULL_SCALE = 60_000.0
"""Value of the farthest depth in the 16-bit image to inpaint: a step is 0.1 mm at 6 m. Telea's method rounds
to whole steps, so floating-point metres would be wrong by up to one metre."""
WINDOW_PX = 7
"""Half width of the joint bilateral window."""
SPACE_SIGMA_PX = 3.5
COLOR_SIGMA = 7.0
"""Root mean square of the three channels' differences, in grey levels."""
LEAST_WEIGHT = 1e-6
"""Least factor of a neighbour's weight by colour, so that every pixel gets a depth."""


def inpainted(method: int, sensor: DepthMap, rgb: ByteArray) -> DepthMap:
    """Inpaint depth as 16-bit numbers with OpenCV; measured pixels are unchanged, colours are not used.

    ``method`` is OpenCV's flag for fast marching (Telea 2004) or Navier-Stokes (Bertalmio et al. 2001).
    """
    require_depth(sensor)
    step_m = float(np.nanmax(sensor.z_m)) / FULL_SCALE
    steps = np.rint(np.where(sensor.valid, sensor.z_m, 0.0) / step_m).astype(np.uint16)
    filled = cv2.inpaint(steps, (~sensor.valid).astype(np.uint8), INPAINT_RADIUS_PX, method)
    return DepthMap(np.where(sensor.valid, sensor.z_m, filled * step_m).astype(np.float32))


def nearest(sensor: DepthMap, rgb: ByteArray) -> DepthMap:
    """Give every pixel the depth of the nearest measured pixel; colours are not used."""
    require_depth(sensor)
    _, labels = cv2.distanceTransformWithLabels(
        (~sensor.valid).astype(np.uint8), cv2.DIST_L2, 5, labelType=cv2.DIST_LABEL_PIXEL
    )
    z_m = np.zeros(labels.max() + 1, np.float32)
    z_m[labels[sensor.valid]] = sensor.z_m[sensor.valid]
    return DepthMap(z_m[labels])


def joint_bilateral(sensor: DepthMap, rgb: ByteArray) -> DepthMap:
    """Average surrounding known depths, weighted by distance and colour similarity, from the rims inwards.

    Iterated joint bilateral upsampling (Kopf et al. 2007): each pass fills the unknown pixels that have a
    known one within 3 pixels, from all known ones within 7.
    """
    require_depth(sensor)
    pad = ((WINDOW_PX, WINDOW_PX), (WINDOW_PX, WINDOW_PX))
    z_m = np.pad(np.where(sensor.valid, sensor.z_m, 0.0).astype(np.float32), pad)
    known = np.pad(sensor.valid, pad)
    smooth = cv2.GaussianBlur(rgb, (0, 0), 1.0)
    colors = np.pad(smooth, (*pad, (0, 0)), mode="edge").astype(np.float32)
    inside = np.pad(np.ones(sensor.valid.shape, bool), pad)
    while not known[inside].all():
        reached = cv2.dilate(known.astype(np.uint8), np.ones((7, 7), np.uint8)) > 0
        rows, columns = np.nonzero(reached & inside & ~known)
        z_m[rows, columns] = weighted_means(z_m, known, colors, rows, columns)
        known[rows, columns] = True
    return DepthMap(z_m[WINDOW_PX:-WINDOW_PX, WINDOW_PX:-WINDOW_PX])


def weighted_means(
    z_m: FloatArray, known: np.ndarray, colors: FloatArray, rows: np.ndarray, columns: np.ndarray
) -> FloatArray:
    """Return (N,) bilateral means of the known depths around the pixels at ``rows`` and ``columns`` (N,)."""
    here = colors[rows, columns]
    total, weights = np.zeros((2, len(rows)), np.float32)
    for down in range(-WINDOW_PX, WINDOW_PX + 1):
        for right in range(-WINDOW_PX, WINDOW_PX + 1):
            there = rows + down, columns + right
            difference = np.mean((colors[there] - here) ** 2, axis=1) / (2.0 * COLOR_SIGMA**2)
            space = np.exp(-(down**2 + right**2) / (2.0 * SPACE_SIGMA_PX**2))
            weight = known[there] * space * (np.exp(-difference) + LEAST_WEIGHT)
            total += weight * z_m[there]
            weights += weight
    return total / weights


def require_depth(sensor: DepthMap) -> None:
    """Raise an InputError if no pixel is measured."""
    if not sensor.valid.any():
        raise InputError("The sensor depth has no valid pixel to fill from; use another frame.")


PEERS: dict[str, Callable[[DepthMap, ByteArray], DepthMap]] = {
    "inpaint-telea": partial(inpainted, cv2.INPAINT_TELEA),
    "inpaint-ns": partial(inpainted, cv2.INPAINT_NS),
    "nearest": nearest,
    "joint-bilateral": joint_bilateral,
}
"""Fillers that return dense depth from the sensor's, some guided by colour; measured depth is unchanged."""
