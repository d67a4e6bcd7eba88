"""Ball radii for uneven sampling: the distance within which a point's neighbours surround it.

For uneven sampling, mean and deviation of the nearest-neighbour distance (``radii``) are not suitable: one
outlier in twenty multiplies the deviation, and along a LiDAR's ring the nearest point is many times nearer
than the next ring. The test whether neighbours surround a point is the angle criterion of Bendels, Schnabel
and Klein (Detecting holes in point set surfaces, 2006).
"""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from pipeline.types import BoolArray, FloatArray

SAMPLE = 2000
"""Most points that are sampled."""
COUNTS = (3, 4, 5, 6, 7, 8, 10, 12, 16, 20, 24, 32, 40, 48, 64, 80, 96, 128, 160, 192)
"""Numbers of nearest neighbours that are tried in turn."""
LARGEST_GAP = np.radians(130.0)
"""Largest angle, rad, between consecutive neighbours around the normal of a surrounded point."""
SHARES = (0.1, 0.5, 0.75, 0.9)
"""Shares of the points that are surrounded within each radius."""
LEAST_SURROUNDED = 0.5
"""Least share of surrounded points in a cloud that is a surface."""


def surrounding_radii(points_m: FloatArray, normals: FloatArray, seed: int = 0) -> tuple[float, ...]:
    """Return ball radii, m, ascending, within which 10 %, 50 %, 75 % and 90 % of the points are surrounded.

    Args:
        points_m: (N, 3) distinct points.
        normals: (N, 3) unit normals of either sign.
        seed: random seed of the sample of points.

    Returns:
        The radii; none if most points are not surrounded.
    """
    distances_m = surrounding_distances_m(points_m, normals, seed)
    found = distances_m[np.isfinite(distances_m)]
    if len(found) < LEAST_SURROUNDED * len(distances_m):
        return ()
    return tuple(np.unique(np.quantile(found, SHARES)).tolist())


def surrounding_distances_m(points_m: FloatArray, normals: FloatArray, seed: int = 0) -> FloatArray:
    """Return (S,) distance within which neighbours surround each of at most ``SAMPLE`` random points.

    It is infinite where even the nearest 192 leave a gap: at a rim, or for an outlier.
    """
    rows = np.random.default_rng(seed).permutation(len(points_m))[:SAMPLE]
    most = min(COUNTS[-1], len(points_m) - 1)
    distances_m, near = cKDTree(points_m).query(points_m[rows], k=range(2, most + 2), workers=-1)
    arms_m = points_m[near] - points_m[rows, None]
    across, along = _tangents(normals[rows])
    angles = np.arctan2(np.einsum("nki,ni->nk", arms_m, along), np.einsum("nki,ni->nk", arms_m, across))
    found_m = np.full(len(rows), np.inf)
    for count in COUNTS:
        left = np.flatnonzero(np.isinf(found_m))
        if count > most or not len(left):
            break
        around = left[_surrounded(angles[left, :count])]
        found_m[around] = distances_m[around, count - 1]
    return found_m


def _surrounded(angles: FloatArray) -> BoolArray:
    """Return (N,) whether (N, k) directions leave no gap wider than ``LARGEST_GAP``."""
    angles = np.sort(angles, axis=1)
    gaps = np.diff(np.column_stack([angles, angles[:, 0] + 2.0 * np.pi]), axis=1)
    return gaps.max(axis=1) <= LARGEST_GAP


def _tangents(normals: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return two (N, 3) unit vectors, orthogonal to each other and to (N, 3) normals."""
    least = np.eye(3)[np.abs(normals).argmin(axis=1)]
    across = np.cross(normals, least)
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    return across, np.cross(normals, across)
