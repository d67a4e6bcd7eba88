"""Thinning of a cloud to one averaged point per voxel."""

from __future__ import annotations

import numba
import numpy as np

from packetmesh.errors import InputError
from pipeline.kernels.ordering import stable_order
from pipeline.types import BoolArray, ByteArray, FloatArray, IntArray, PointCloud

_COUNT_TOLERANCE = 0.02
"""Tolerance of the number of points, as a share of it."""
_FINEST = 1e-6
"""Smallest voxel that is tried, as a share of the cloud's extent."""
_MAX_TRIALS = 40
"""Most voxel edges that are tried."""


def voxel_average(cloud: PointCloud, voxel_m: float) -> PointCloud:
    """Replace the points in every occupied cube of edge ``voxel_m`` by their mean.

    The cubes have a corner at the origin, so clouds in one frame are thinned on one grid; the
    result is ordered by x, then y, then z of the cubes. Colours and sigmas are averaged, normals
    averaged and normalised; the source is that of the majority, the sensor's in a tie. Pixels
    have no mean and are dropped.

    Raises:
        InputError: ``voxel_m`` is not positive, or too small for the extent of the cloud.
    """
    first, cell, count = _cubes(_cube_keys(cloud.points_m, voxel_m))

    def mean(column: FloatArray | ByteArray) -> FloatArray:
        return _sums(np.ascontiguousarray(column), cell, len(count)) / count[:, None]

    return PointCloud(
        points_m=mean(cloud.points_m),
        colors=None if cloud.colors is None else np.rint(mean(cloud.colors)).astype(np.uint8),
        normals=None if cloud.normals is None else _unit(mean(cloud.normals), cloud.normals[first]),
        sigma_m=None if cloud.sigma_m is None else mean(cloud.sigma_m[:, None])[:, 0],
        source=None if cloud.source is None else (mean(cloud.source[:, None])[:, 0] > 0.5).astype(np.uint8),
    )


def in_cubes_of(points_m: FloatArray, others_m: FloatArray, voxel_m: float) -> BoolArray:
    """Return (M,) True for each of (M, 3) others that shares a cube of edge ``voxel_m`` with a point."""
    keys = _cube_keys(np.concatenate([points_m, others_m]), voxel_m)
    return np.isin(keys[len(points_m) :], keys[: len(points_m)])


def voxel_for_count(points_m: FloatArray, count: int, least_m: float = 0.0) -> float:
    """Find the voxel edge, metres, that thins (N, 3) points to about ``count``, but at least ``least_m``.

    For no more than ``count`` points it is ``least_m``, or 1e-6 of their extent if larger. Else it is found
    by bisection with guesses from count ~ 1 / voxel^2, the law for surfaces.

    Raises:
        InputError: no point, or all coincident.
    """
    lower_m, upper_m = _bounds(np.ascontiguousarray(points_m, np.float64))
    extent_m = float((upper_m - lower_m).max())
    if not extent_m > 0.0:
        raise InputError(
            f"A cloud of {len(points_m)} points in one place has no spacing; check the depth image"
        )
    low_m, high_m = extent_m * _FINEST, extent_m
    if len(points_m) <= count:
        return max(low_m, least_m)
    if least_m > low_m:
        if _occupied(points_m, least_m) <= count:
            return least_m
        low_m = least_m
    voxel_m = min(max(extent_m / np.sqrt(count), low_m), high_m)
    for _ in range(_MAX_TRIALS):
        occupied = _occupied(points_m, voxel_m)
        if abs(occupied - count) <= _COUNT_TOLERANCE * count:
            break
        low_m, high_m = (voxel_m, high_m) if occupied > count else (low_m, voxel_m)
        guess_m = voxel_m * np.sqrt(occupied / count)
        voxel_m = guess_m if low_m < guess_m < high_m else np.sqrt(low_m * high_m)
    return float(voxel_m)


def _occupied(points_m: FloatArray, voxel_m: float) -> int:
    """Count the cubes that contain at least one of (N, 3) points."""
    keys = _cube_keys(points_m, voxel_m)
    return 1 + int(np.count_nonzero(np.diff(keys[stable_order(keys)])))


def _cube_keys(points_m: FloatArray, voxel_m: float) -> IntArray:
    """Return (N,) integer key of each point's cube, ascending in x, then y, then z."""
    if not voxel_m > 0.0:
        raise InputError(f"The voxel size is {voxel_m} m; try a positive one, for example 0.01")
    if not len(points_m):
        return np.empty(0, dtype=np.int64)
    points_m = np.ascontiguousarray(points_m, np.float64)
    least_m, most_m = _bounds(points_m)
    first = np.floor(least_m / voxel_m)
    sizes = np.floor(most_m / voxel_m) - first + 1.0
    if not np.prod(sizes) < 2.0**63:
        raise InputError(f"The voxel size {voxel_m:.3g} m is too small for this cloud; try a larger one")
    return _keys(points_m, voxel_m, first, sizes.astype(np.int64))


@numba.njit(cache=True, nogil=True)
def _bounds(points_m):  # type: ignore[no-untyped-def]
    """Return (3,) least and (3,) greatest coordinates of (N, 3) points; NaN if any is not finite."""
    least_m, most_m = np.full(3, np.inf), np.full(3, -np.inf)
    for row in range(len(points_m)):
        for axis in range(3):
            if not np.isfinite(points_m[row, axis]):
                return np.full(3, np.nan), np.full(3, np.nan)
            least_m[axis] = min(least_m[axis], points_m[row, axis])
            most_m[axis] = max(most_m[axis], points_m[row, axis])
    return least_m, most_m


@numba.njit(cache=True, nogil=True)
def _keys(points_m, voxel_m, first, sizes):  # type: ignore[no-untyped-def]
    """Return (N,) cube of each of (N, 3) points in a grid of ``sizes`` that begins at cube ``first``."""
    keys = np.empty(len(points_m), np.int64)
    for row in range(len(points_m)):
        key = 0
        for axis in range(3):
            key = key * sizes[axis] + int(np.floor(points_m[row, axis] / voxel_m) - first[axis])
        keys[row] = key
    return keys


def _cubes(keys: IntArray) -> tuple[IntArray, IntArray, IntArray]:
    """Return (V,) first row of each cube by ascending key, (N,) cube of each row, (V,) rows per cube."""
    first, cell, count, cubes = _in_order(keys, stable_order(keys))
    return first[:cubes], cell, count[:cubes]


@numba.njit(cache=True, nogil=True)
def _in_order(keys, order):  # type: ignore[no-untyped-def]
    """Compute the arrays of ``_cubes``, as long as the keys, and the number of cubes."""
    first, cell, count = np.empty_like(order), np.empty_like(order), np.zeros_like(order)
    cubes = 0
    for place in range(len(order)):
        row = order[place]
        if place == 0 or keys[row] != keys[order[place - 1]]:
            first[cubes] = row
            cubes += 1
        cell[row] = cubes - 1
        count[cubes - 1] += 1
    return first, cell, count, cubes


@numba.njit(cache=True, nogil=True)
def _sums(column, cell, cells):  # type: ignore[no-untyped-def]
    """Return (cells, K) float64 sums, over each cell, of the rows of an (N, K) array."""
    sums = np.zeros((cells, column.shape[1]))
    for row in range(len(column)):
        for part in range(column.shape[1]):
            sums[cell[row], part] += column[row, part]
    return sums


def _unit(vectors: FloatArray, fallback: FloatArray) -> FloatArray:
    """Normalise vectors; use ``fallback`` where opposite normals cancelled out."""
    length = np.linalg.norm(vectors, axis=1, keepdims=True)
    return np.where(length > 1e-6, vectors / np.maximum(length, 1e-6), fallback)
