"""Smoothing of a thinned cloud by moving least squares, before the ball rolls over it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.spatial import cKDTree

from pipeline.types import FloatArray, PointCloud

NEIGHBOURS = 20
KERNEL_SHARE = 0.5
"""Standard deviation of the Gaussian weight over the distance of the farthest neighbour."""


def smooth(cloud: PointCloud, passes: int) -> PointCloud:
    """Move every point along its normal onto the plane that fits its neighbours best.

    The first-order moving least squares of Alexa et al. 2003, with 20 neighbours. Where the noise is
    as thick as the points are apart, a ball that should roll along a wall gets caught inside it; this
    makes walls thin again. Points move along normals only, so their density stays.

    Args:
        cloud: points with normals; the new normals keep their side.
        passes: how often; 0 changes nothing.
    """
    for _ in range(passes):
        cloud = _pass(cloud)
    return cloud


def _pass(cloud: PointCloud) -> PointCloud:
    if cloud.normals is None or len(cloud) < 4:
        return cloud
    count = min(NEIGHBOURS, len(cloud))
    distances_m, rows = cKDTree(cloud.points_m).query(cloud.points_m, k=count, workers=-1)
    reach_m = np.maximum(KERNEL_SHARE * distances_m[:, -1:], 1e-12)
    weights = np.exp(-0.5 * (distances_m / reach_m) ** 2)
    centers_m, normals = _planes(cloud.points_m[rows], weights / weights.sum(axis=1, keepdims=True))
    normals *= np.where(np.sum(normals * cloud.normals, axis=1, keepdims=True) < 0, -1.0, 1.0)
    offsets_m = np.sum((centers_m - cloud.points_m) * normals, axis=1, keepdims=True)
    return replace(cloud, points_m=cloud.points_m + offsets_m * normals, normals=normals)


def _planes(neighbours_m: FloatArray, weights: FloatArray) -> tuple[FloatArray, FloatArray]:
    """(N, 3) weighted centres and (N, 3) unit normals of (N, k, 3) neighbourhoods."""
    centers_m = np.einsum("nk,nki->ni", weights, neighbours_m)
    spread_m = neighbours_m - centers_m[:, None]
    covariance_m2 = np.einsum("nk,nki,nkj->nij", weights, spread_m, spread_m)
    return centers_m, np.linalg.eigh(covariance_m2)[1][:, :, 0]
