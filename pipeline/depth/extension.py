"""Extension of a field into unknown pixels, with its slope and along similar colours (SPEC 3.5)."""

from __future__ import annotations

import cv2
import numpy as np

from pipeline.kernels.kdtree import compiled
from pipeline.types import BoolArray, ByteArray, FloatArray, IntArray

FILL_WIDTH_PX = 320
"""Width at which holes are filled, before upsampling along the colours."""
WINDOW_PX = 3
SPACE_SIGMA_PX = 1.7
SLOPE_SIGMA_PX = 6.0
"""Half width of the window and sigmas, in pixels at the filling width; these three fit hidden sensor depth
best."""
COLOR_SIGMA = 7.0
"""Root mean square of the three channels' differences, in grey levels."""
LEAST_WEIGHT = 1e-6
SLOPE_SHARE = 0.5
"""Share of the slope around a hole that is continued inside it."""
SLOPE_DECAY = 0.97
"""Factor of the slope after each ring of pixels inwards."""
LARGEST_SLOPE = 0.03
"""Largest slope, in logarithmic depth per pixel; a steeper one is an edge."""


def extrapolated(field: FloatArray, known: BoolArray, rgb: ByteArray) -> FloatArray:
    """Return the (H, W) field with its unknown pixels inpainted at ``FILL_WIDTH_PX`` and upsampled.

    If no pixel is known at that width, the unknown pixels get the median.

    Args:
        field: (H, W) float32.
        known: (H, W) True where the field is known; at least one pixel.
        rgb: (H, W, 3) uint8.
    """
    step = max(1, round(known.shape[1] / FILL_WIDTH_PX))
    small = (slice(step // 2, None, step),) * 2
    if not known[small].any():
        return np.where(known, field, np.float32(np.median(field[known])))
    colors = cv2.GaussianBlur(rgb, (0, 0), 1.0) / np.float32(COLOR_SIGMA * np.sqrt(6.0))
    small_colors = np.ascontiguousarray(colors[small])
    coarse = inpainted(field[small], known[small], small_colors)
    filled = field.copy()
    _upsample(filled, known, colors, coarse, small_colors, step)
    return filled


def inpainted(field: FloatArray, known: BoolArray, colors: FloatArray) -> FloatArray:
    """Fill the unknown pixels of a field from the rims inwards, one ring of pixels per pass.

    Args:
        field: (H, W) float32.
        known: (H, W) True where the field is known; at least one pixel.
        colors: (H, W, 3), scaled so that a difference of one reduces a weight to 1/e.
    """
    values = np.stack([field, *slopes(field, known)], axis=-1)
    reach_px = np.arange(-WINDOW_PX, WINDOW_PX + 1)
    space = np.exp(-(reach_px[:, None] ** 2 + reach_px**2) / (2.0 * SPACE_SIGMA_PX**2)).astype(np.float32)
    _inpaint(values, known.copy(), colors, space)
    return values[..., 0]


@compiled
def _inpaint(values: FloatArray, known: BoolArray, colors: FloatArray, space: FloatArray) -> None:
    """Fill the unknown pixels of (H, W, 3) field, slope down and slope to the right, ring by ring."""
    rows, columns = known.shape
    waiting = np.empty((known.size, 2), np.int64)
    filled = np.empty((known.size, 3), np.float32)
    reached = known.copy()
    count = 0
    for v in range(rows):
        for u in range(columns):
            if known[v, u]:
                count = _reach_beside(reached, v, u, waiting, count)
    first = 0
    while first < count:
        last = count
        for i in range(first, last):
            _predict(values, known, colors, space, waiting[i, 0], waiting[i, 1], filled[i])
        for i in range(first, last):
            v, u = waiting[i, 0], waiting[i, 1]
            known[v, u] = True
            for part in range(3):
                values[v, u, part] = filled[i, part]
            count = _reach_beside(reached, v, u, waiting, count)
        first = last


@compiled
def _reach_beside(reached: BoolArray, v: int, u: int, waiting: IntArray, count: int) -> int:
    """Append the unreached neighbours of a pixel to ``waiting``; returns the new count."""
    for y in range(max(v - 1, 0), min(v + 2, reached.shape[0])):
        for x in range(max(u - 1, 0), min(u + 2, reached.shape[1])):
            if not reached[y, x]:
                reached[y, x] = True
                waiting[count, 0], waiting[count, 1] = y, x
                count += 1
    return count


@compiled
def _predict(
    values: FloatArray,
    known: BoolArray,
    colors: FloatArray,
    space: FloatArray,
    v: int,
    u: int,
    predicted: FloatArray,
) -> None:
    """Write (3,) field and slopes at a pixel, predicted from known pixels with (7, 7) spatial weights."""
    total = field = slope_down = slope_right = 0.0
    for y in range(max(v - WINDOW_PX, 0), min(v + WINDOW_PX + 1, known.shape[0])):
        for x in range(max(u - WINDOW_PX, 0), min(u + WINDOW_PX + 1, known.shape[1])):
            if known[y, x]:
                down, right = y - v, x - u
                weight = space[down + WINDOW_PX, right + WINDOW_PX] * _likeness(colors[y, x], colors[v, u])
                total += weight
                field += weight * (values[y, x, 0] - down * values[y, x, 1] - right * values[y, x, 2])
                slope_down += weight * values[y, x, 1]
                slope_right += weight * values[y, x, 2]
    predicted[0] = field / total
    predicted[1] = SLOPE_DECAY * slope_down / total
    predicted[2] = SLOPE_DECAY * slope_right / total


@compiled
def _likeness(color: FloatArray, other: FloatArray) -> float:
    """Return the weight of two colours' difference, at least ``LEAST_WEIGHT``."""
    red, green, blue = color[0] - other[0], color[1] - other[1], color[2] - other[2]
    return np.exp(-(red * red + green * green + blue * blue)) + LEAST_WEIGHT


def slopes(field: FloatArray, known: BoolArray) -> tuple[FloatArray, FloatArray]:
    """Return the two (H, W) slopes, down and to the right, that holes continue; 0 far from known slopes."""
    found = []
    for axis in (0, 1):
        before, after = (np.roll(field, way, axis) for way in (1, -1))
        slope = 0.5 * (after - before)
        sound = known & np.roll(known, 1, axis) & np.roll(known, -1, axis) & (np.abs(slope) < LARGEST_SLOPE)
        np.moveaxis(sound, axis, 0)[[0, -1]] = False  # np.roll gives them the opposite border as a neighbour
        count, total = (
            cv2.GaussianBlur(layer.astype(np.float32), (0, 0), SLOPE_SIGMA_PX)
            for layer in (sound, np.where(sound, slope, 0.0))
        )
        found.append(SLOPE_SHARE * total / (count + 0.01))
    return found[0], found[1]


@compiled
def _upsample(
    field: FloatArray,
    known: BoolArray,
    colors: FloatArray,
    coarse: FloatArray,
    coarse_colors: FloatArray,
    step: int,
) -> None:
    """Fill a field's unknown pixels from the coarse field, bilinearly with more weight for similar colours.

    Args:
        field: (H, W) float32.
        known: (H, W) True for pixels that are not changed.
        colors: (H, W, 3) colours of the field's pixels.
        coarse: (h, w) values at every ``step``-th pixel, starting at ``step // 2``.
        coarse_colors: (h, w, 3) colours at these pixels.
        step: pixels per coarse pixel.
    """
    for row in range(known.shape[0]):
        for column in range(known.shape[1]):
            if known[row, column]:
                continue
            v, u = max((row - step // 2) / step, 0.0), max((column - step // 2) / step, 0.0)
            top, left = int(v), int(u)
            total = weights = 0.0
            for down in range(2):
                for right in range(2):
                    y, x = min(top + down, coarse.shape[0] - 1), min(left + right, coarse.shape[1] - 1)
                    share_down = v - top if down else 1.0 - (v - top)
                    share_right = u - left if right else 1.0 - (u - left)
                    weight = share_down * share_right * _likeness(coarse_colors[y, x], colors[row, column])
                    total += weight * coarse[y, x]
                    weights += weight
            field[row, column] = total / weights
