"""Distances, distinct points and extent of a set of points."""

from __future__ import annotations

import numpy as np

from pipeline.kernels.kdtree import KdTree
from pipeline.types import FloatArray, IntArray


def neighbour_distances_m(points_m: FloatArray, count: int) -> FloatArray:
    """Return (N, count) distances of (N, 3) points to their nearest others; fewer columns for small N."""
    return KdTree(points_m).nearest(points_m, min(count + 1, len(points_m)))[0][:, 1:]


def distinct_rows(points_m: FloatArray) -> IntArray:
    """Return (M,) ascending rows of (N, 3) points that do not repeat an earlier one."""
    if np.diff(np.sort(points_m[:, 0])).all():  # the usual case, tested in a fraction of the time
        return np.arange(len(points_m))
    order = np.lexsort(points_m.T)  # stable: equal points keep their order
    ordered_m = points_m[order]
    return np.sort(order[np.append(True, (ordered_m[1:] != ordered_m[:-1]).any(axis=1))])


def middle_extent_m(points_m: FloatArray) -> float:
    """Return the widest side of the box around the middle 90 % of (N, 3) points."""
    return float(np.ptp(np.quantile(points_m, (0.05, 0.95), axis=0), axis=0).max())


def ascending(rows: IntArray, count: int) -> IntArray:
    """Return distinct rows of ``count`` points in ascending order, a tenth of the time of sorting them."""
    among = np.zeros(count, dtype=bool)
    among[rows] = True
    return np.flatnonzero(among)
