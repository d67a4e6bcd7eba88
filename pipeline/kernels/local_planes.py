"""Planes fitted to the neighbourhoods of points, compiled: their normals, and smoothing onto them."""

from __future__ import annotations

import numpy as np

from pipeline.kernels.kdtree import (
    KdTree,
    compiled,
    in_parts,
    room_for,
    search_many,
    squared_distance,
    working_space,
)
from pipeline.types import ByteArray, FloatArray, IntArray

_SWEEPS = 10
"""Most sweeps of Jacobi's rotations; a 3 x 3 matrix needs four or five."""
_LEAST_GAP = 1e-2
"""Least gap between the two smallest eigenvalues, relative to the whole range, for the closed form."""


def patch_normals(tree: KdTree, neighbours: int) -> FloatArray:
    """Return unit normals, of either sign, of the planes fitted to the nearest neighbours of a tree's points.

    Args:
        tree: tree of N points.
        neighbours: points per plane, including the point itself.

    Returns:
        (N, 3) normals, in the order of the original points.
    """
    normals = np.empty((len(tree), 3))
    count, queries = min(neighbours, len(tree)), np.arange(len(tree))
    unused = np.empty((0, 0), np.int64), np.empty((0, 0))

    def work(first: int, last: int) -> None:
        _normals(*tree.parts, queries, first, last, count, normals, *unused)

    in_parts(work, len(tree))
    normals[tree.order] = normals.copy()
    return normals


def shared_normals(tree: KdTree, neighbours: int, rows: IntArray) -> FloatArray:
    """Return (N, 3) unit normals like ``patch_normals``, by the planes around some of the points only.

    A point takes the normal of the plane with the nearest centre among those fitted to it; the few points to
    which no plane is fitted get their own.

    Args:
        tree: tree of N points.
        neighbours: points per plane.
        rows: (M,) rows of the points that get planes.
    """
    normals, squared = np.empty((len(tree), 3)), np.full(len(tree), np.inf)
    place = np.empty(len(tree), np.int64)
    place[tree.order] = np.arange(len(tree))
    queries = np.sort(place[rows])
    count = min(neighbours, len(tree))
    _give(*_planes(tree, count, queries), squared, normals)
    alone = np.flatnonzero(np.isinf(squared))
    normals[alone] = _planes(tree, count, alone)[0]
    ordered = np.empty_like(normals)
    ordered[tree.order] = normals
    return ordered


def _planes(tree: KdTree, count: int, queries: IntArray) -> tuple[FloatArray, IntArray, FloatArray]:
    """Return the (M, 3) normals around points of the tree, (M, count) neighbours, squared distances."""
    normals, near = np.empty((len(queries), 3)), np.empty((len(queries), count), np.int64)
    squared = np.empty((len(queries), count))

    def work(first: int, last: int) -> None:
        _normals(*tree.parts, queries, first, last, count, normals, near, squared)

    in_parts(work, len(queries))
    return normals, near, squared


@compiled
def _give(
    axes: FloatArray, near: IntArray, apart: FloatArray, squared: FloatArray, normals: FloatArray
) -> None:
    """Write each of (M, 3) normals to those of its neighbours that are closer to it than to earlier ones."""
    for m in range(len(near)):
        for k in range(near.shape[1]):
            i = near[m, k]
            if apart[m, k] < squared[i]:
                squared[i] = apart[m, k]
                for a in range(3):
                    normals[i, a] = axes[m, a]


def onto_patches(
    points_m: FloatArray, neighbours: int, kernel_share: float, rows: IntArray
) -> tuple[FloatArray, FloatArray]:
    """Move points along the normals of planes fitted to their neighbours, weighted by a Gaussian of distance.

    Args:
        points_m: (N, 3) points.
        neighbours: points per plane, including the point itself; at most N.
        kernel_share: standard deviation of the Gaussian over the distance of the farthest neighbour.
        rows: (M,) rows of the points to move.

    Returns:
        (M, 3) moved points, and (M, 3) unit normals there, of either sign.
    """
    tree = KdTree(points_m)
    place = np.empty(len(tree), np.int64)
    place[tree.order] = np.arange(len(tree))
    queries = np.sort(place[rows])
    moved_m, normals = np.empty((len(tree), 3)), np.empty((len(tree), 3))

    def work(first: int, last: int) -> None:
        _move(*tree.parts, tree.order, queries[first:last], neighbours, kernel_share, moved_m, normals)

    in_parts(work, len(queries))
    return moved_m[rows], normals[rows]


@compiled
def _normals(
    points: FloatArray,
    axes: ByteArray,
    splits: FloatArray,
    levels: int,
    queries: IntArray,
    first: int,
    last: int,
    count: int,
    normals: FloatArray,
    neighbours: IntArray,
    apart: FloatArray,
) -> None:
    """Write the normals around the points ``queries``, and their neighbours if there is room for them."""
    stack, bounds = working_space()
    squared, rows = np.empty(room_for(count)), np.zeros(room_for(count), dtype=np.intp)
    near, weights, center, spread = rows[:count], np.ones(count), np.empty(3), np.empty((3, 3))
    farthest = np.inf
    for i in range(first, last):
        place = points[queries[i]]
        limit = _reach(points[queries[max(first, i - 1)]], place, farthest)
        farthest = search_many(
            points, axes, splits, levels, place, count, limit, squared, rows, stack, bounds
        )
        if len(neighbours):
            neighbours[i], apart[i] = near, squared[:count]
        _scatter(points, near, weights, place, center, spread)
        _thinnest(spread, normals[i])


@compiled
def _move(
    points: FloatArray,
    axes: ByteArray,
    splits: FloatArray,
    levels: int,
    order: IntArray,
    queries: IntArray,
    count: int,
    kernel_share: float,
    moved: FloatArray,
    normals: FloatArray,
) -> None:
    stack, bounds = working_space()
    squared, rows = np.empty(room_for(count)), np.zeros(room_for(count), dtype=np.intp)
    near, weights, center, spread = rows[:count], np.empty(count), np.empty(3), np.empty((3, 3))
    farthest, before = np.inf, points[0]
    for i in queries:
        place, row = points[i], order[i]
        limit = _reach(before, place, farthest)
        farthest = search_many(
            points, axes, splits, levels, place, count, limit, squared, rows, stack, bounds
        )
        reach = max(kernel_share * np.sqrt(farthest), 1e-12)
        for k in range(count):
            weights[k] = np.exp(-0.5 * squared[k] / (reach * reach))
        _scatter(points, near, weights, place, center, spread)
        _thinnest(spread, normals[row])
        offset = 0.0
        for a in range(3):
            offset += center[a] * normals[row, a]
        for a in range(3):
            moved[row, a] = place[a] + offset * normals[row, a]
        before = place


@compiled
def _reach(before: FloatArray, place: FloatArray, farthest: float) -> float:
    """Return a squared radius around ``place`` that covers the squared ``farthest`` around ``before``."""
    reach = np.sqrt(squared_distance(before, place)) + np.sqrt(farthest)
    return reach * reach * (1.0 + 1e-12) + 1e-300


@compiled
def _scatter(
    points: FloatArray,
    near: IntArray,
    weights: FloatArray,
    place: FloatArray,
    center: FloatArray,
    spread: FloatArray,
) -> None:
    """Compute the patch's weighted centre relative to ``place``, and the (3, 3) covariance about it."""
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
    """Write the unit eigenvector of a symmetric matrix's smallest eigenvalue; overwrites the matrix.

    The eigenvalue follows Smith 1961; the vector is orthogonal to the rows of the matrix minus this value.
    If the next eigenvalue is too close for enough digits, Jacobi's rotations find both.
    """
    mean = (spread[0, 0] + spread[1, 1] + spread[2, 2]) / 3.0
    a, b, c = spread[0, 0] - mean, spread[1, 1] - mean, spread[2, 2] - mean
    d, e, f = spread[0, 1], spread[0, 2], spread[1, 2]
    scale = np.sqrt((a * a + b * b + c * c + 2.0 * (d * d + e * e + f * f)) / 6.0)
    if scale > 0.0:
        half = (a * (b * c - f * f) - d * (d * c - f * e) + e * (d * f - b * e)) / (2.0 * scale**3)
        angle = np.arccos(min(1.0, max(-1.0, half))) / 3.0
        largest, least = 2.0 * scale * np.cos(angle), 2.0 * scale * np.cos(angle + 2.0 * np.pi / 3.0)
        if -largest - 2.0 * least > _LEAST_GAP * (largest - least):
            _across(a - least, b - least, c - least, d, e, f, axis)
            return
    _jacobi(spread, axis)


@compiled
def _across(a: float, b: float, c: float, d: float, e: float, f: float, axis: FloatArray) -> None:
    """Write the unit vector normal to all rows of ((a, d, e), (d, b, f), (e, f, c)), a matrix of rank two."""
    longest = 0.0
    for x, y, z in (
        (d * f - e * b, e * d - a * f, a * b - d * d),
        (d * c - e * f, e * e - a * c, a * f - d * e),
        (b * c - f * f, f * e - d * c, d * f - b * e),
    ):
        squared = x * x + y * y + z * z
        if squared > longest:
            longest, axis[0], axis[1], axis[2] = squared, x, y, z
    length = np.sqrt(longest)
    for k in range(3):
        axis[k] /= length


@compiled
def _jacobi(spread: FloatArray, axis: FloatArray) -> None:
    """Do the same as ``_thinnest``, for any eigenvalues."""
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
    """Make the entry (a, b) zero by one Jacobi rotation (Golub, Van Loan, section 8.5)."""
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
