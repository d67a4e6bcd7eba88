"""What the nearest neighbours of a point tell: spacing and surface normal."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from pipeline.types import FloatArray


def median_spacing_m(points_m: FloatArray) -> float:
    """Median distance of (N, 3) points to their nearest other point."""
    distances_m, _ = cKDTree(points_m).query(points_m, k=2, workers=-1)
    return float(np.median(distances_m[:, 1]))


def pca_normals(points_m: FloatArray, neighbours: int = 20) -> FloatArray:
    """(N, 3) unit normals of the planes through each point's neighbours, towards a camera at the origin."""
    count = min(neighbours, len(points_m))
    _, nearest = cKDTree(points_m).query(points_m, k=count, workers=-1)
    patches_m = points_m[nearest]
    patches_m = patches_m - patches_m.mean(axis=1, keepdims=True)
    _, axes = np.linalg.eigh(np.einsum("nki,nkj->nij", patches_m, patches_m))
    normals = axes[:, :, 0]
    away = np.einsum("ni,ni->n", normals, points_m) > 0
    return np.where(away[:, None], -normals, normals)


def local_spacing_m(points_m: FloatArray, neighbours: int = 4) -> FloatArray:
    """(N,) mean distance of each point to its nearest others; zero for a lone point."""
    if len(points_m) < 2:
        return np.zeros(len(points_m))
    count = min(neighbours + 1, len(points_m))
    distances_m, _ = cKDTree(points_m).query(points_m, k=count, workers=-1)
    return distances_m[:, 1:].mean(axis=1)
