"""A field known at some pixels continued into others, with its slope and along like colours (SPEC 3.5)."""

from __future__ import annotations

import cv2
import numpy as np

from pipeline.types import BoolArray, ByteArray, FloatArray, IntArray

FILL_WIDTH_PX = 320
"""Corrections are continued into holes at this width, then brought to full size along the colours."""
WINDOW_PX = 3
SPACE_SIGMA_PX = 1.7
SLOPE_SIGMA_PX = 6.0
"""Pixels at the filling width; three numbers that fill hidden sensor depth best."""
COLOR_SIGMA = 7.0
"""Root mean square of the three channels' differences, in grey levels."""
LEAST_WEIGHT = 1e-6
SLOPE_SHARE = 0.5
"""Share of the slope around a hole that goes on inside it."""
SLOPE_DECAY = 0.97
"""What is left of it after every pass inwards."""
LARGEST_SLOPE = 0.03
"""Logarithmic depth a pixel; steeper is an edge."""


def extrapolated(field: FloatArray, known: BoolArray, rgb: ByteArray) -> FloatArray:
    """(H, W) the field where it is known; elsewhere inpainted at ``FILL_WIDTH_PX`` and upsampled."""
    step = max(1, round(known.shape[1] / FILL_WIDTH_PX))
    small = (slice(step // 2, None, step),) * 2
    colors = cv2.GaussianBlur(rgb, (0, 0), 1.0).transpose(2, 0, 1) / np.float32(COLOR_SIGMA * np.sqrt(6.0))
    if not known[small].any():
        return np.where(known, field, np.float32(np.median(field[known])))
    coarse = inpainted(field[small], known[small], colors[:, *small])
    filled = field.copy()
    rows, columns = np.nonzero(~known)
    filled[rows, columns] = upsampled(
        coarse, colors[:, *small], colors[:, rows, columns], rows, columns, step
    )
    return filled


def inpainted(field: FloatArray, known: BoolArray, colors: FloatArray) -> FloatArray:
    """The field with its unknown pixels filled from the rims inwards, a pass for every ring of pixels.

    Args:
        field: (H, W) float32.
        known: (H, W) where it means something; at least one pixel.
        colors: (3, H, W) in units in which a difference of one leaves 1/e of a weight.
    """
    pad = ((WINDOW_PX, WINDOW_PX),) * 2
    weight = np.pad(known.astype(np.float32), pad)
    values = np.pad(np.stack([field, *slopes(field, known)]), ((0, 0), *pad)).reshape(3, -1)
    color = np.pad(colors, ((0, 0), *pad)).reshape(3, -1)
    inside = np.pad(np.ones(known.shape, bool), pad)
    while True:
        rim = inside & (weight == 0.0) & (cv2.dilate(weight, np.ones((3, 3))) > 0.0)
        pixels = np.flatnonzero(rim)
        if not len(pixels):
            break
        values[:, pixels] = predicted(values, color, weight.ravel(), pixels, inside.shape[1])
        weight[rim] = 1.0
    return values[0].reshape(inside.shape)[WINDOW_PX:-WINDOW_PX, WINDOW_PX:-WINDOW_PX]


def predicted(
    values: FloatArray, colors: FloatArray, known: FloatArray, pixels: IntArray, width_px: int
) -> FloatArray:
    """(3, N) field and slopes at ``pixels`` from the known pixels around.

    Args:
        values: (3, P) field, slope down and slope to the right of an image ``width_px`` wide.
        colors: (3, P).
        known: (P,) weights, 0 where unknown.
        pixels: (N,) indices of the pixels to predict.
        width_px: of the padded image.
    """
    reach_px = np.arange(-WINDOW_PX, WINDOW_PX + 1)
    down, right = (axis.ravel() for axis in np.meshgrid(reach_px, reach_px, indexing="ij"))
    there = pixels[:, None] + (down * width_px + right)
    space = np.exp(-(down**2 + right**2) / (2.0 * SPACE_SIGMA_PX**2)).astype(np.float32)
    weights = known.take(there) * space * color_weights(colors.take(there, axis=1), colors[:, pixels, None])
    weights /= weights.sum(axis=1, keepdims=True)
    field, slope_down, slope_right = values.take(there, axis=1)
    field -= down.astype(np.float32) * slope_down + right.astype(np.float32) * slope_right
    total = np.stack([np.einsum("nk,nk->n", weights, v) for v in (field, slope_down, slope_right)])
    total[1:] *= SLOPE_DECAY
    return total


def color_weights(colors: FloatArray, others: FloatArray) -> FloatArray:
    """(...) weight of the difference of two (3, ...) arrays of colours, never quite zero."""
    return np.exp(-np.square(colors - others).sum(axis=0)) + np.float32(LEAST_WEIGHT)


def slopes(field: FloatArray, known: BoolArray) -> tuple[FloatArray, FloatArray]:
    """(H, W) slope down and slope to the right that are trusted to go on, zero where none is near."""
    found = []
    for axis in (0, 1):
        before, after = (np.roll(field, way, axis) for way in (1, -1))
        slope = 0.5 * (after - before)
        sound = known & np.roll(known, 1, axis) & np.roll(known, -1, axis) & (np.abs(slope) < LARGEST_SLOPE)
        count, total = (
            cv2.GaussianBlur(layer.astype(np.float32), (0, 0), SLOPE_SIGMA_PX)
            for layer in (sound, np.where(sound, slope, 0.0))
        )
        found.append(SLOPE_SHARE * total / (count + 0.01))
    return found[0], found[1]


def upsampled(
    coarse: FloatArray,
    coarse_colors: FloatArray,
    colors: FloatArray,
    rows: IntArray,
    columns: IntArray,
    step: int,
) -> FloatArray:
    """(N,) the coarse field at full-size pixels, bilinear with the weights of like colours raised.

    Args:
        coarse: (h, w) every ``step``-th pixel from ``step // 2`` on.
        coarse_colors: (3, h, w).
        colors: (3, N) of the pixels.
        rows: (N,) full-size.
        columns: (N,) full-size.
        step: full-size pixels a coarse pixel.
    """
    v, u = (np.maximum((at - step // 2) / step, 0.0).astype(np.float32) for at in (rows, columns))
    top, left = v.astype(int), u.astype(int)
    v, u = v - top, u - left
    flat, flat_colors = coarse.ravel(), coarse_colors.reshape(3, -1)
    total, weights = np.zeros((2, len(rows)), np.float32)
    for y, share_down in ((top, 1.0 - v), (np.minimum(top + 1, coarse.shape[0] - 1), v)):
        for x, share_right in ((left, 1.0 - u), (np.minimum(left + 1, coarse.shape[1] - 1), u)):
            there = y * coarse.shape[1] + x
            weight = share_down * share_right * color_weights(flat_colors.take(there, axis=1), colors)
            total += weight * flat.take(there)
            weights += weight
    return total / weights
