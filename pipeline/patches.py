"""Planes through the neighbourhoods of points, compiled: their normals, and smoothing onto them."""

from __future__ import annotations

import numpy as np

from pipeline.kdtree import KdTree, compiled, in_parts, search, working_space
from pipeline.types import ByteArray, FloatArray, IntArray

_SWEEPS = 10
"""Of Jacobi's rotations at most; a matrix of three rows needs four or five."""


def patch_normals(tree: KdTree, places_m: FloatArray, neighbours: int) -> FloatArray:
    """(M, 3) unit normals, of either sign, of the planes through the nearest points of (M, 3) places."""
    places_m = np.ascontiguousarray(places_m, dtype=np.float64)
    normals = np.empty_like(places_m)
    count = min(neighbours, len(tree))

    def work(first: int, last: int) -> None:
        _normals(*tree.parts, places_m, first, last, count, normals)

    in_parts(work, len(places_m))
    return normals


def onto_patches(points_m: FloatArray, neighbours: int, kernel_share: float) -> tuple[FloatArray, FloatArray]:
    """Points moved along the normals of the planes that fit their neighbours best, nearer ones counting more.

    Args:
        points_m: (N, 3).
        neighbours: of a point, itself included; at most N.
        kernel_share: standard deviation of the Gaussian weight over the distance of the farthest of them.

    Returns:
        (N, 3) points, and (N, 3) unit normals of either sign.
    """
    tree = KdTree(points_m)
    moved_m, normals = np.empty((len(tree), 3)), np.empty((len(tree), 3))

    def work(first: int, last: int) -> None:
        _move(*tree.parts, tree.order, first, last, neighbours, kernel_share, moved_m, normals)

    in_parts(work, len(tree))
    return moved_m, normals


@compiled
def _normals(
    points: FloatArray,
    axes: ByteArray,
    splits: FloatArray,
    levels: int,
    places: FloatArray,
    first: int,
    last: int,
    count: int,
    normals: FloatArray,
) -> None:
    stack, bounds = working_space()
    squared, near = np.empty(count), np.zeros(count, dtype=np.intp)
    weights, center, spread = np.ones(count), np.empty(3), np.empty((3, 3))
    for i in range(first, last):
        squared[:] = np.inf
        search(points, axes, splits, levels, places[i], squared, near, stack, bounds)
        _scatter(points, near, weights, places[i], center, spread)
        _thinnest(spread, normals[i])


@compiled
def _move(
    points: FloatArray,
    axes: ByteArray,
    splits: FloatArray,
    levels: int,
    order: IntArray,
    first: int,
    last: int,
    count: int,
    kernel_share: float,
    moved: FloatArray,
    normals: FloatArray,
) -> None:
    stack, bounds = working_space()
    squared, near = np.empty(count), np.zeros(count, dtype=np.intp)
    weights, center, spread = np.empty(count), np.empty(3), np.empty((3, 3))
    for i in range(first, last):
        place, row = points[i], order[i]
        squared[:] = np.inf
        search(points, axes, splits, levels, place, squared, near, stack, bounds)
        reach = max(kernel_share * np.sqrt(squared[count - 1]), 1e-12)
        for k in range(count):
            weights[k] = np.exp(-0.5 * squared[k] / (reach * reach))
        _scatter(points, near, weights, place, center, spread)
        _thinnest(spread, normals[row])
        offset = 0.0
        for a in range(3):
            offset += center[a] * normals[row, a]
        for a in range(3):
            moved[row, a] = place[a] + offset * normals[row, a]


@compiled
def _scatter(
    points: FloatArray,
    near: IntArray,
    weights: FloatArray,
    place: FloatArray,
    center: FloatArray,
    spread: FloatArray,
) -> None:
    """The patch's weighted centre, from ``place``, which is near it, and the (3, 3) scatter about it."""
    spread[:], center[:], total = 0.0, 0.0, 0.0
    for k in range(len(near)):
        total += weights[k]
        for a in range(3):
            arm = points[near[k], a] - place[a]
            center[a] += weights[k] * arm
            for b in range(a, 3):
                spread[a, b] += weights[k] * arm * (points[near[k], b] - place[b])
    for a in range(3):
        center[a] /= total
    for a in range(3):
        for b in range(a, 3):
            spread[a, b] = spread[a, b] / total - center[a] * center[b]
            spread[b, a] = spread[a, b]


@compiled
def _thinnest(spread: FloatArray, axis: FloatArray) -> None:
    """Write the unit eigenvector of a symmetric matrix's smallest eigenvalue; spoils the matrix."""
    axes = np.eye(3)
    for _ in range(_SWEEPS):
        off = abs(spread[0, 1]) + abs(spread[0, 2]) + abs(spread[1, 2])
        if off <= 1e-18 * (abs(spread[0, 0]) + abs(spread[1, 1]) + abs(spread[2, 2])):
            break
        for a in range(2):
            for b in range(a + 1, 3):
                if spread[a, b] != 0.0:
                    _rotate(spread, axes, a, b)
    k = 0
    for a in range(1, 3):
        if spread[a, a] < spread[k, k]:
            k = a
    axis[0], axis[1], axis[2] = axes[0, k], axes[1, k], axes[2, k]


@compiled
def _rotate(spread: FloatArray, axes: FloatArray, a: int, b: int) -> None:
    """One of Jacobi's rotations: the entry (a, b) becomes zero (Golub, Van Loan, section 8.5)."""
    ratio = (spread[b, b] - spread[a, a]) / (2.0 * spread[a, b])
    tangent = 1.0 / (abs(ratio) + np.sqrt(1.0 + ratio * ratio))
    if ratio < 0.0:
        tangent = -tangent
    cosine = 1.0 / np.sqrt(1.0 + tangent * tangent)
    sine = tangent * cosine
    for k in range(3):
        left, right = spread[k, a], spread[k, b]
        spread[k, a], spread[k, b] = cosine * left - sine * right, sine * left + cosine * right
    for k in range(3):
        left, right = spread[a, k], spread[b, k]
        spread[a, k], spread[b, k] = cosine * left - sine * right, sine * left + cosine * right
    for k in range(3):
        left, right = axes[k, a], axes[k, b]
        axes[k, a], axes[k, b] = cosine * left - sine * right, sine * left + cosine * right
