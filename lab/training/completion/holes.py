"""Training frames with holes: those that sensors leave, and shapes of every size."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from lab.training.dataset import augment
from pipeline.depth.slopes import GRID_WIDTH_PX, Grid
from pipeline.types import BoolArray, ByteArray, FloatArray

NEAR_M, FAR_M = 0.2, 20.0
NOISE = 0.012
"""Largest standard deviation of the noise, in shares of the depth."""
STEP = 0.03
"""Coarsest step of inverse depth, 1/m; a Kinect's is 0.003."""
BIAS = 0.02
"""Largest scale of the sensor's smooth bias, in log depth."""
OBJECT_STEP = 0.02
"""Largest step of log depth between neighbouring cells of one smooth piece."""
LARGEST_OBJECT = 0.3
"""Largest share of the image that a hidden piece may fill."""
MOST_HIDDEN = 0.85
"""Share of the surface from which the holes are too large, and a single ellipse is hidden instead."""
FLYING_STEP = 0.05
"""Step of log depth across a cell from which it may be a flying pixel."""
MOST_FLYING = 0.15
"""Largest share of the pixels at edges that report a depth between front and back."""
COLORLESS = 0.12
"""Share of frames without colours, so that the network also learns to continue depth alone."""


@dataclass(frozen=True, slots=True)
class Lesson:
    """One training frame on the coarse grid."""

    grid: Grid
    log_z: FloatArray
    """(H, W) measured log depth, with its noise; in the holes, true log depth with the sensor's bias; NaN
    without a surface. A difference from a measured pixel starts at its noisy value, as in completion."""


def lesson(rgb: ByteArray, depth_m: FloatArray, rng: np.random.Generator) -> Lesson:
    """Return a view of a room as a random sensor sees it, with all depth scaled by a random factor.

    Args:
        rgb: (240, 320, 3).
        depth_m: (240, 320) true depth, NaN without a surface.
        rng: draws colours, the sensor's errors, and the holes.
    """
    rgb, depth_m = augment(rgb, depth_m, rng)
    step = depth_m.shape[1] // GRID_WIDTH_PX
    y, x = rng.integers(step, size=2)
    z_m = np.ascontiguousarray(depth_m[y::step, x::step]) * np.exp(rng.normal(0.0, 0.3))
    colors = cv2.resize(rgb, z_m.shape[::-1], interpolation=cv2.INTER_AREA)
    on_surface = np.isfinite(z_m) & (z_m > NEAR_M) & (z_m < FAR_M)
    true = np.log(np.where(on_surface, z_m, 1.0)).astype(np.float32)
    if rng.random() < 0.5:  # the sensor's bias continues in its holes
        true += field(z_m.shape, rng.uniform(10.0, 40.0), rng) * np.float32(rng.uniform(0.0, BIAS))
    known = on_surface & ~hidden(true, on_surface, colors, rng)
    if known.sum() < 50:
        known = on_surface
    noisy = displaced_edges(true, on_surface, rng) if rng.random() < 0.6 else true
    noisy = noisy + rng.standard_normal(true.shape) * rng.uniform(0.0, NOISE)
    if rng.random() < 0.4:
        noisy = noisy + field(true.shape, rng.uniform(1.5, 4.0), rng) * rng.uniform(0.0, NOISE)
    if rng.random() < 0.6:
        coarse = rng.uniform(0.0, STEP) + 1e-6
        noisy = -np.log(np.maximum(np.rint(np.exp(-noisy) / coarse), 1.0) * coarse)
    seen = np.where(known, noisy, 0.0).astype(np.float32)
    learned = np.where(known, seen, np.where(on_surface, true, np.nan)).astype(np.float32)
    return Lesson(Grid(seen, known, misregistered(colors, rng)), learned)


def displaced_edges(log_z: FloatArray, on_surface: BoolArray, rng: np.random.Generator) -> FloatArray:
    """Return log depth with edges displaced by up to a cell, and a few pixels between front and back."""
    window = np.ones((3, 3), np.uint8)
    front, back = cv2.erode(log_z, window), cv2.dilate(log_z, window)
    rows, columns = log_z.shape
    y, x = np.indices(log_z.shape) + rng.integers(-1, 2, (2, rows, columns))
    y, x = np.clip(y, 0, rows - 1), np.clip(x, 0, columns - 1)
    moved = np.where(on_surface[y, x], log_z[y, x], log_z)
    share = rng.random(log_z.shape)
    flying = (back - front > FLYING_STEP) & (rng.random(log_z.shape) < rng.uniform(0.0, MOST_FLYING))
    return np.where(flying & on_surface, front + share * (back - front), moved)


def misregistered(rgb: ByteArray, rng: np.random.Generator) -> ByteArray:
    """Return colours shifted and turned as by bad registration, or sometimes noise about a single colour."""
    if rng.random() < COLORLESS:
        level = rng.integers(0, 256, 3)
        noise = rng.normal(0.0, rng.uniform(1.0, 20.0), rgb.shape)
        return np.clip(level + noise, 0, 255).astype(np.uint8)
    if rng.random() < 0.5:
        (right, down), turn = rng.normal(0.0, 1.0, 2), rng.normal(0.0, 0.005)
        motion = np.array([[1.0, -turn, right], [turn, 1.0, down]])
        rgb = cv2.warpAffine(rgb, motion, rgb.shape[1::-1], borderMode=cv2.BORDER_REPLICATE)
    return rgb


def hidden(log_z: FloatArray, on_surface: BoolArray, rgb: ByteArray, rng: np.random.Generator) -> BoolArray:
    """Return (H, W) True at lost pixels: margins, edges, dark, bright, far, random shapes, objects."""
    rows, columns = log_z.shape
    lost = np.zeros(log_z.shape, bool)
    top, bottom, left, right = rng.integers(0, 7, 4) if rng.random() < 0.7 else (0, 0, 0, 0)
    lost[:top] = lost[rows - bottom :] = lost[:, :left] = lost[:, columns - right :] = True
    if rng.random() < 0.7:
        lost |= around_edges(log_z, int(rng.integers(1, 4)), rng)
    if rng.random() < 0.3:
        grey = cv2.GaussianBlur(cv2.cvtColor(rgb, cv2.COLOR_RGB2GRAY), (0, 0), 1.0)
        lost |= grey < np.quantile(grey, rng.uniform(0.0, 0.3))
    if rng.random() < 0.15:
        grey = cv2.GaussianBlur(cv2.cvtColor(rgb, cv2.COLOR_RGB2GRAY), (0, 0), 1.0)
        lost |= grey > np.quantile(grey, rng.uniform(0.85, 1.0))
    if rng.random() < 0.3:
        lost |= log_z > np.quantile(log_z[on_surface], rng.uniform(0.6, 1.0))
    if rng.random() < 0.4:
        lost |= field(log_z.shape, rng.uniform(1.0, 8.0), rng) > rng.uniform(1.0, 2.5)
    for _ in range(int(rng.choice([0, 1, 2, 4], p=[0.2, 0.3, 0.3, 0.2]))):
        lost |= ellipse(log_z.shape, rng)
    for _ in range(int(rng.choice([0, 1, 2], p=[0.5, 0.3, 0.2]))):
        lost |= smooth_piece(log_z, on_surface, rng)
    return lost if lost[on_surface].mean() < MOST_HIDDEN else ellipse(log_z.shape, rng)


def around_edges(log_z: FloatArray, width_px: int, rng: np.random.Generator) -> BoolArray:
    """Return (H, W) True in a ragged band along depth steps, often only on the far side, like a shadow."""
    window = np.ones((3, 3), np.uint8)
    low, high = cv2.erode(log_z, window), cv2.dilate(log_z, window)
    edge = high - low > rng.uniform(0.03, 0.15)
    band = cv2.dilate(edge.astype(np.uint8), np.ones((width_px, 2 * width_px - 1), np.uint8)) > 0
    if rng.random() < 0.5:
        near = cv2.blur(log_z, (7, 7)) > log_z + 0.01
        band &= ~near
    return band & (field(log_z.shape, 2.0, rng) > rng.uniform(-2.0, 0.5))


def ellipse(shape: tuple[int, int], rng: np.random.Generator) -> BoolArray:
    """Return (H, W) True in a random ellipse of about 2 to 35 cells; the log of its size is uniform."""
    rows, columns = shape
    radius = np.exp(rng.uniform(np.log(2.0), np.log(35.0)))
    axes = radius * np.exp(rng.normal(0.0, 0.25, 2))
    y, x = np.indices(shape) - rng.uniform(0.0, 1.0, (2, 1, 1)) * np.array([rows, columns]).reshape(2, 1, 1)
    angle = rng.uniform(0.0, np.pi)
    along, across = x * np.cos(angle) + y * np.sin(angle), y * np.cos(angle) - x * np.sin(angle)
    return (along / axes[0]) ** 2 + (across / axes[1]) ** 2 <= 1.0


def smooth_piece(log_z: FloatArray, on_surface: BoolArray, rng: np.random.Generator) -> BoolArray:
    """Return (H, W) True in the smooth piece of surface around a random pixel; empty if it is too large."""
    seeds = np.argwhere(on_surface)
    y, x = seeds[rng.integers(len(seeds))]
    mask = np.zeros((log_z.shape[0] + 2, log_z.shape[1] + 2), np.uint8)
    flags = 4 | cv2.FLOODFILL_MASK_ONLY | 255 << 8
    filled = cv2.floodFill(log_z.copy(), mask, (int(x), int(y)), 0.0, OBJECT_STEP, OBJECT_STEP, flags)[2]
    piece = filled[1:-1, 1:-1]
    if piece.mean() > 255.0 * LARGEST_OBJECT:
        return np.zeros(log_z.shape, bool)
    size = int(rng.integers(1, 4))
    return cv2.dilate(piece, np.ones((size, size), np.uint8)) > 0


def field(shape: tuple[int, int], sigma_px: float, rng: np.random.Generator) -> FloatArray:
    """Return (H, W) float32 smooth noise of unit variance."""
    noise = rng.standard_normal(shape, dtype=np.float32)
    blurred = cv2.GaussianBlur(noise, (0, 0), sigma_px, borderType=cv2.BORDER_REFLECT)
    return blurred / np.float32(blurred.std() + 1e-9)
