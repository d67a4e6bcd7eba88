"""Spacing and surface normals of a cloud, from the nearest neighbours of its points."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from pipeline.points import neighbour_distances_m
from pipeline.types import FloatArray

NORMAL_NEIGHBOURS, SPACING_NEIGHBOURS = 20, 4


def median_spacing_m(points_m: FloatArray) -> float:
    """Median distance of (N, 3) points to their nearest other point."""
    return float(np.median(neighbour_distances_m(points_m, 1)))


def pca_normals(points_m: FloatArray) -> FloatArray:
    """(N, 3) unit normals of the planes through each point's nearest 20, towards a camera at the origin."""
    count = min(NORMAL_NEIGHBOURS, len(points_m))
    _, nearest = cKDTree(points_m).query(points_m, k=count, workers=-1)
    patches_m = points_m[nearest]
    patches_m = patches_m - patches_m.mean(axis=1, keepdims=True)
    _, axes = np.linalg.eigh(np.einsum("nki,nkj->nij", patches_m, patches_m))
    normals = axes[:, :, 0]
    away = np.einsum("ni,ni->n", normals, points_m) > 0
    return np.where(away[:, None], -normals, normals)


def local_spacing_m(points_m: FloatArray) -> FloatArray:
    """(N,) mean distance of each point to its nearest four others; zero for a lone point."""
    if len(points_m) < 2:
        return np.zeros(len(points_m))
    return neighbour_distances_m(points_m, SPACING_NEIGHBOURS).mean(axis=1)
