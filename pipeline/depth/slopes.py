"""Depth from measured pixels and predicted differences: a linear system over a coarse grid.

A network that says how logarithmic depth differs between pixels, and how sure it is, leaves the depth itself
to least squares: measured pixels are fixed, every difference is a spring (the optimisation layer of OGNI-DC,
Zuo and Deng 2024; several distances, as in OMNI-DC, Zuo et al. 2025).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import cv2
import numpy as np
from scipy.sparse import coo_matrix, diags
from scipy.sparse.linalg import cg

from pipeline.types import BoolArray, ByteArray, FloatArray

GRID_WIDTH_PX = 160
DISTANCES = (1, 4, 16)
"""Grid cells between the two ends of a difference; the long ones carry depth across wide holes."""
CHANNELS_IN = 8
CHANNELS_OUT = 2 + 4 * len(DISTANCES)
MULTIPLE = 16
"""The network takes sides of this multiple; what is added is unknown and black."""
SLOPE_CLIP = 0.05
SLOPE_SIGMA = 2.0
LARGEST = 1.5
"""Logarithmic depths are clipped this far from their median on their way into the network."""
LOG_SCALES = (-7.0, 2.0)
"""Of a difference's Laplace distribution, in logarithmic depth."""
STEPS = 200
TOLERANCE = 1e-4


@dataclass(frozen=True, slots=True)
class Grid:
    """A sensor's depth and its colours on the coarse grid."""

    log_z: FloatArray
    """(H, W) float32 logarithmic depth; zero where unknown."""
    known: BoolArray
    """(H, W)."""
    rgb: ByteArray
    """(H, W, 3)."""


def coarse(z_m: FloatArray, known: BoolArray, rgb: ByteArray) -> Grid:
    """Colours averaged over cells of the grid; of each cell's measured depths the middle-most in place."""
    rows, columns = known.shape
    step = max(1, round(columns / GRID_WIDTH_PX))
    height, width = rows // step, columns // step
    cut = np.s_[: height * step, : width * step]
    small = cv2.resize(np.ascontiguousarray(rgb[cut]), (width, height), interpolation=cv2.INTER_AREA)
    offsets = np.array([(y, x) for y in range(step) for x in range(step)]) - 0.5 * (step - 1)
    order = np.argsort((offsets**2).sum(axis=1), kind="stable")
    log_z, found = np.zeros((height, width), np.float32), np.zeros((height, width), bool)
    for place in order:
        y, x = divmod(int(place), step)
        there = known[cut][y::step, x::step]
        take = there & ~found
        log_z[take] = np.log(z_m[cut][y::step, x::step][take])
        found |= there
    return Grid(log_z, found, small)


def network_input(grid: Grid) -> tuple[FloatArray, FloatArray]:
    """What the network sees, and the fill from which it starts.

    Returns:
        (8, H, W) float32 on a grid of multiples of 16: colours, mask, the nearest logarithmic depth less the
        frame's median, the distance to it, and the slope measured there; and (H, W) the nearest
        logarithmic depth, H and W those of the grid.
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
    """(H, W) slopes of logarithmic depth along x and y, blurred over measured pixels on one surface."""
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
        blur = (cv2.GaussianBlur(plane, (0, 0), SLOPE_SIGMA) for plane in (total, weight))
        total, weight = blur
        slopes.append(total / (weight + 1e-3))
    return slopes[0], slopes[1]


def solved(grid: Grid, start: FloatArray, output: FloatArray) -> FloatArray:
    """The logarithmic depth that fits the network's answer best, weighted by how sure it is.

    Minimises sum (s(p) - start(p) - m0)^2 / v0 + sum (s(p + d) - s(p) - m)^2 / v over the unknown pixels, by
    conjugate gradients; v = 2 b^2 is the variance of Laplace's distribution of scale b.

    Args:
        grid: what is measured stays as it is.
        start: (H, W) of ``network_input``.
        output: (14, H', W') of the network: m0, log b0, then m and log b of every difference.

    Returns:
        (H, W) logarithmic depth.
    """
    rows, columns = grid.known.shape
    output = output[:, :rows, :columns].astype(np.float64)
    unknown = np.flatnonzero(~grid.known)
    if not len(unknown):
        return grid.log_z
    place = np.full(grid.known.size, -1)
    place[unknown] = np.arange(len(unknown))
    known_z = grid.log_z.ravel().astype(np.float64)
    stiffness = _stiffness(output[1]).ravel()[unknown]
    guess = (start + output[0]).ravel()[unknown]
    diagonal, force = stiffness.copy(), stiffness * guess
    matrix = coo_matrix((len(unknown), len(unknown)))
    number = np.arange(grid.known.size).reshape(rows, columns)
    for link, (near, far) in enumerate(_ends(rows, columns)):
        a, b = number[near].ravel(), number[far].ravel()
        k = _stiffness(output[3 + 2 * link])[near].ravel()
        pull = k * output[2 + 2 * link][near].ravel()
        i, j = place[a], place[b]
        both, first, second = (i >= 0) & (j >= 0), (i >= 0) & (j < 0), (i < 0) & (j >= 0)
        for here, sign, free in ((i, -1.0, i >= 0), (j, 1.0, j >= 0)):
            diagonal += np.bincount(here[free], k[free], len(unknown))
            force += np.bincount(here[free], sign * pull[free], len(unknown))
        force += np.bincount(i[first], (k * known_z[b])[first], len(unknown))
        force += np.bincount(j[second], (k * known_z[a])[second], len(unknown))
        matrix += coo_matrix((-k[both], (i[both], j[both])), matrix.shape)
    system = (matrix + matrix.T + diags(diagonal)).tocsr()
    jacobi = diags(1.0 / diagonal)
    filled, _ = cg(system, force, guess, rtol=TOLERANCE, maxiter=STEPS, M=jacobi)
    log_z = known_z.copy()
    log_z[unknown] = filled
    return log_z.reshape(rows, columns).astype(np.float32)


def _stiffness(log_scale: FloatArray) -> FloatArray:
    """Inverse variance of Laplace's distribution."""
    return 0.5 * np.exp(-2.0 * np.clip(log_scale, *LOG_SCALES))


def _ends(rows: int, columns: int) -> Iterator[tuple[tuple[slice, ...], tuple[slice, ...]]]:
    """Where the near and the far ends of the differences lie: of every distance, along x then y."""
    for distance in DISTANCES:
        yield np.s_[:, : max(0, columns - distance)], np.s_[:, distance:]
        yield np.s_[: max(0, rows - distance), :], np.s_[distance:, :]
