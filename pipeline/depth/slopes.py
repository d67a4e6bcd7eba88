"""Computation of depth from measured pixels and predicted differences, by a linear system on a coarse grid.

A network predicts differences of logarithmic depth between pixels, and their certainty. Weighted least
squares finds the depth that fits them, with measured pixels fixed (the optimisation layer of OGNI-DC, Zuo
and Deng 2024; several distances, as in OMNI-DC, Zuo et al. 2025).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import cv2
import numpy as np
from scipy.sparse import csr_matrix, diags
from scipy.sparse.linalg import cg

from pipeline.types import BoolArray, ByteArray, FloatArray

GRID_WIDTH_PX = 160
DISTANCES = (1, 4, 16)
"""Distances, in grid cells, between the cells of a difference; long ones carry depth across wide holes."""
CHANNELS_IN = 8
CHANNELS_OUT = 2 + 4 * len(DISTANCES)
MULTIPLE = 16
"""Both sides of the network's input are multiples of this; padding has unknown depth and is mid-grey."""
SLOPE_CLIP = 0.05
SLOPE_SIGMA = 2.0
LARGEST = 1.5
"""Largest deviation of logarithmic depth from its median in the network's input; larger ones are clipped."""
LOG_SCALES = (-7.0, 2.0)
"""Range of the log scale of a difference's Laplace distribution, in logarithmic depth."""
STEPS = 200
TOLERANCE = 1e-4


@dataclass(frozen=True, slots=True)
class Grid:
    """A sensor's depth and colours on the coarse grid."""

    log_z: FloatArray
    """(H, W) float32 logarithmic depth; zero where unknown."""
    known: BoolArray
    """(H, W) True where the depth is known."""
    rgb: ByteArray
    """(H, W, 3) mean colours."""


def coarse(z_m: FloatArray, known: BoolArray, rgb: ByteArray) -> Grid:
    """Reduce colours to means over grid cells, and depth to the measured pixel nearest to a cell's centre.

    Images whose sides are no multiples of the cell are padded with unknown depth.
    """
    rows, columns = known.shape
    step = cell_px(columns)
    missing = -rows % step, -columns % step
    margin = (0, missing[0]), (0, missing[1])
    z_m, known = np.pad(z_m, margin), np.pad(known, margin)
    rgb = np.asarray(cv2.copyMakeBorder(rgb, 0, missing[0], 0, missing[1], cv2.BORDER_REPLICATE), np.uint8)
    height, width = known.shape[0] // step, known.shape[1] // step
    small = np.asarray(cv2.resize(rgb, (width, height), interpolation=cv2.INTER_AREA), np.uint8)
    offsets = np.array([(y, x) for y in range(step) for x in range(step)]) - 0.5 * (step - 1)
    log_z, found = np.zeros((height, width), np.float32), np.zeros((height, width), bool)
    for place in np.argsort((offsets**2).sum(axis=1), kind="stable"):
        y, x = divmod(int(place), step)
        take = known[y::step, x::step] & ~found
        log_z[take] = np.log(z_m[y::step, x::step][take])
        found |= take
    return Grid(log_z, found, small)


def cell_px(width_px: int) -> int:
    """Return the side of a cell in pixels, for an image of this width."""
    return max(1, round(width_px / GRID_WIDTH_PX))


def network_input(grid: Grid) -> tuple[FloatArray, FloatArray]:
    """Compute the network's input, and the depth from which the solution starts.

    Returns:
        (8, H, W) float32, padded to multiples of 16: colours, mask, nearest logarithmic depth minus the
            frame's median, distance to it, and the slope measured there; and (H, W) nearest logarithmic depth
            on the unpadded grid.
    """
    rows, columns = grid.known.shape
    mask = grid.known.astype(np.float32)
    distance, labels = cv2.distanceTransformWithLabels(
        (~grid.known).astype(np.uint8), cv2.DIST_L2, 5, labelType=cv2.DIST_LABEL_PIXEL
    )
    source = np.zeros(labels.max() + 1, np.int64)
    source[labels[grid.known]] = np.flatnonzero(grid.known)
    nearest = source[labels]
    start = grid.log_z.ravel()[nearest]
    level = np.float32(np.median(grid.log_z[grid.known]))
    slopes = [slope.ravel()[nearest] for slope in measured_slopes(grid)]
    planes = np.stack(
        [
            *((grid.rgb.transpose(2, 0, 1).astype(np.float32) - 127.5) / 64.0),
            mask,
            np.clip(start - level, -LARGEST, LARGEST),
            np.log1p(distance) / 2.0,
            *(slope / SLOPE_CLIP for slope in slopes),
        ]
    ).astype(np.float32)
    pad = ((0, 0), (0, -rows % MULTIPLE), (0, -columns % MULTIPLE))
    return np.pad(planes, pad), start


def measured_slopes(grid: Grid) -> tuple[FloatArray, FloatArray]:
    """Return (H, W) slopes of log depth along x and y, blurred over measured pixels on one surface."""
    slopes = []
    for axis in (1, 0):
        first = tuple(slice(None, -1) if a == axis else slice(None) for a in (0, 1))
        second = tuple(slice(1, None) if a == axis else slice(None) for a in (0, 1))
        step = grid.log_z[second] - grid.log_z[first]
        counts = grid.known[second] & grid.known[first] & (np.abs(step) < SLOPE_CLIP)
        total, weight = np.zeros((2, *grid.known.shape), np.float32)
        for part in (first, second):
            total[part] += step * counts
            weight[part] += counts
        total, weight = (cv2.GaussianBlur(plane, (0, 0), SLOPE_SIGMA) for plane in (total, weight))
        slopes.append(total / (weight + 1e-3))
    return slopes[0], slopes[1]


def solved(grid: Grid, start: FloatArray, output: FloatArray) -> FloatArray:
    """Compute the logarithmic depth that fits the network's output best, weighted by its certainty.

    Minimises sum (s(p) - start(p) - m0)^2 / v0 + sum (s(p + d) - s(p) - m)^2 / v over the unknown pixels, by
    conjugate gradients; v = 2 b^2 is the variance of a Laplace distribution with scale b.

    Args:
        grid: grid whose measured depth is kept.
        start: (H, W) start from ``network_input``.
        output: (14, H', W') of the network: m0, log b0, then m and log b of every difference.

    Returns:
        (H, W) logarithmic depth.
    """
    if grid.known.all():
        return grid.log_z
    rows, columns = grid.known.shape
    predicted = output[:, :rows, :columns].astype(np.float64)
    guess = (start + predicted[0])[~grid.known]
    system, force = _balance(grid, guess, predicted)
    jacobi = diags(1.0 / system.diagonal())
    filled, _ = cg(system, force, guess, rtol=TOLERANCE, maxiter=STEPS, M=jacobi)
    log_z = grid.log_z.copy()
    log_z[~grid.known] = filled
    return log_z


def _balance(grid: Grid, guess: FloatArray, predicted: FloatArray) -> tuple[csr_matrix, FloatArray]:
    """Build the linear system (N, N) and its right side (N,) for the unknown pixels' depth."""
    rows, columns = grid.known.shape
    count = len(guess)
    place = np.full(grid.known.shape, -1)
    place[~grid.known] = np.arange(count)
    diagonal = _stiffness(predicted[1])[~grid.known]
    force = diagonal * guess
    links: csr_matrix = csr_matrix((count, count))
    for number, (near, far) in enumerate(_ends(rows, columns)):
        i, j = place[near].ravel(), place[far].ravel()
        k = _stiffness(predicted[3 + 2 * number])[near].ravel()
        pull = k * predicted[2 + 2 * number][near].ravel()
        for here, there, sign, beyond in ((i, j, -1.0, far), (j, i, 1.0, near)):
            free = here >= 0
            diagonal += np.bincount(here[free], k[free], count)
            force += np.bincount(here[free], sign * pull[free], count)
            held = free & (there < 0)
            force += np.bincount(here[held], (k * grid.log_z[beyond].ravel())[held], count)
        both = (i >= 0) & (j >= 0)
        links += csr_matrix((-k[both], (i[both], j[both])), (count, count))
    return (links + links.T + diags(diagonal)).tocsr(), force


def _stiffness(log_scale: FloatArray) -> FloatArray:
    """Return the inverse variance of Laplace distributions, by their log scales cut to ``LOG_SCALES``."""
    return 0.5 * np.exp(-2.0 * np.clip(log_scale, *LOG_SCALES))


def _ends(rows: int, columns: int) -> Iterator[tuple[tuple[slice, ...], tuple[slice, ...]]]:
    """Yield the slices of the near and far cells of all differences, for each distance along x, then y."""
    for distance in DISTANCES:
        yield np.s_[:, : max(0, columns - distance)], np.s_[:, distance:]
        yield np.s_[: max(0, rows - distance), :], np.s_[distance:, :]
