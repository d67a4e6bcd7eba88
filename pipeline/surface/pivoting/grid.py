"""Grid of cells to find the points near a position in constant time and linear memory."""

from __future__ import annotations

from typing import NamedTuple

import numba
import numpy as np

from pipeline.surface.pivoting.compiled import compiled
from pipeline.types import FloatArray, IntArray

_CELLS_A_POINT = 4
_LEAST_CELLS = 512
_FARTHEST = 2.0**60


class Grid(NamedTuple):
    """Points sorted by their cells.

    The number of cells along an axis is a bounded power of two; the grid repeats periodically beyond
    the last cell. So a few points far away cost neither memory nor time.
    """

    points_m: FloatArray
    """(n, 3) points, ordered by cell."""
    ids: IntArray
    """(n,) index of each point in the cloud."""
    starts: IntArray
    """(cells + 1,) first row of every cell; x runs fastest, then y, then z."""
    first: IntArray
    """(3,) first occupied cell on each axis, counted from the origin, without the periodic repetition."""
    last: IntArray
    """(3,) last occupied cell on each axis."""
    sizes: IntArray
    """(3,) number of cells on each axis."""
    cell_m: float


def build_grid(points_m: FloatArray, ids: IntArray, cell_m: float) -> Grid:
    """Build the grid of the points ``ids`` of a cloud, with cubic cells."""
    kept_m = points_m[ids]
    first = np.array([_cell(low_m, cell_m) for low_m in kept_m.min(axis=0)])
    last = np.array([_cell(high_m, cell_m) for high_m in kept_m.max(axis=0)])
    exponents = np.ceil(np.log2(last - first + 1.0)).astype(np.int64)
    budget = np.log2(_CELLS_A_POINT * len(ids) + _LEAST_CELLS)
    while exponents.sum() > budget:
        exponents[np.argmax(exponents)] -= 1
    sizes = 2**exponents
    order, starts = _sort(kept_m, sizes, cell_m)
    return Grid(kept_m[order], ids[order].astype(np.int32), starts, first, last, sizes, cell_m)


@compiled
def _cell(place_m, cell_m):  # type: ignore[no-untyped-def]
    """Return the cell of a coordinate, counted from the origin."""
    return np.int64(np.floor(min(max(place_m / cell_m, -_FARTHEST), _FARTHEST)))


@numba.njit(cache=True, nogil=True)
def _sort(points_m, sizes, cell_m):  # type: ignore[no-untyped-def]
    """Sort the points by cell (counting sort); returns the order, and the first row of each cell."""
    keys = np.empty(len(points_m), np.int64)
    starts = np.zeros(sizes[0] * sizes[1] * sizes[2] + 1, np.int32)
    for n in range(len(points_m)):
        key = np.int64(0)
        for axis in (2, 1, 0):
            key = key * sizes[axis] + (_cell(points_m[n, axis], cell_m) & (sizes[axis] - 1))
        keys[n] = key
        starts[key + 1] += 1
    for cell in range(1, len(starts)):
        starts[cell] += starts[cell - 1]
    order = np.empty(len(points_m), np.int32)
    fill = starts[:-1].copy()
    for n in range(len(points_m)):
        order[fill[keys[n]]] = n
        fill[keys[n]] += 1
    return order, starts


@compiled
def _cells(low_m, high_m, first, last, size, cell_m):  # type: ignore[no-untyped-def]
    """Return first and last cell of an interval on one axis, with each of the grid's cells at most once."""
    low, high = max(_cell(low_m, cell_m), first), min(_cell(high_m, cell_m), last)
    return low, min(high, low + size - 1)


@compiled
def gather(grid, x, y, z, reach_m, found):  # type: ignore[no-untyped-def]
    """Fill ``found`` with the rows of the points within a distance of a position; returns their number."""
    points, starts, first, last, cell_m = grid.points_m, grid.starts, grid.first, grid.last, grid.cell_m
    size_x, size_y, size_z = grid.sizes[0], grid.sizes[1], grid.sizes[2]
    i0, i1 = _cells(x - reach_m, x + reach_m, first[0], last[0], size_x, cell_m)
    j0, j1 = _cells(y - reach_m, y + reach_m, first[1], last[1], size_y, cell_m)
    k0, k1 = _cells(z - reach_m, z + reach_m, first[2], last[2], size_z, cell_m)
    count = 0
    if i1 < i0:
        return count
    begin_x = i0 & (size_x - 1)
    end_x = begin_x + i1 - i0 + 1
    for k in range(k0, k1 + 1):
        for j in range(j0, j1 + 1):
            base = ((k & (size_z - 1)) * size_y + (j & (size_y - 1))) * size_x
            begin, end = starts[base + begin_x], starts[base + min(end_x, size_x)]
            count = _select(points, begin, end, x, y, z, reach_m, found, count)
            if end_x > size_x:
                begin, end = starts[base], starts[base + end_x - size_x]
                count = _select(points, begin, end, x, y, z, reach_m, found, count)
    return count


@compiled
def _select(points, begin, end, x, y, z, reach_m, found, count):  # type: ignore[no-untyped-def]
    """Append those rows from ``begin`` to ``end`` that are within a distance; returns the new count."""
    for row in range(begin, end):
        dx, dy, dz = points[row, 0] - x, points[row, 1] - y, points[row, 2] - z
        found[count] = row
        count += dx * dx + dy * dy + dz * dz <= reach_m * reach_m
    return count
