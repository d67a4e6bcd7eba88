"""Smoothing of a thinned cloud by moving least squares, before the ball rolls over it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from pipeline.kernels.local_planes import onto_patches
from pipeline.types import IntArray, PointCloud

NEIGHBOURS = 20
KERNEL_SHARE = 0.5
"""Standard deviation of the Gaussian weight over the distance of the farthest neighbour."""


def smooth(cloud: PointCloud, passes: int, rows: IntArray | None = None) -> PointCloud:
    """Move every point along its normal onto the plane that fits its neighbours best.

    The first-order moving least squares of Alexa et al. 2003, with 20 neighbours. Where the noise is
    as thick as the points are apart, a ball that should roll along a wall gets caught inside it; this
    makes walls thin again. Points move along normals only, so their density stays.

    Args:
        cloud: points with normals; the new normals keep their side.
        passes: how often; 0 changes nothing.
        rows: (M,) of the points to return; None for all.
    """
    for _ in range(passes - 1):
        cloud = _pass(cloud, np.arange(len(cloud)))
    if passes:
        return _pass(cloud, np.arange(len(cloud)) if rows is None else rows)
    return cloud if rows is None else cloud.select(rows)


def _pass(cloud: PointCloud, rows: IntArray) -> PointCloud:
    """Of the points at (M,) rows; the others only lie around them."""
    kept = cloud.select(rows)
    if kept.normals is None or len(cloud) < 4:
        return kept
    points_m, normals = onto_patches(cloud.points_m, min(NEIGHBOURS, len(cloud)), KERNEL_SHARE, rows)
    normals *= np.where(np.sum(normals * kept.normals, axis=1, keepdims=True) < 0, -1.0, 1.0)
    return replace(kept, points_m=points_m, normals=normals)
