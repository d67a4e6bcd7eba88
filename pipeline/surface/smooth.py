"""Smoothing of a thinned cloud by moving least squares, before the ball rolls over it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from pipeline.kernels.local_planes import onto_patches
from pipeline.types import IntArray, PointCloud

NEIGHBOURS = 20
KERNEL_SHARE = 0.5
"""Ratio of the Gaussian weight's standard deviation to the distance of the farthest neighbour."""


def smooth(cloud: PointCloud, passes: int, rows: IntArray | None = None) -> PointCloud:
    """Move every point along its normal onto the plane that fits its neighbours best.

    This is first-order moving least squares (Alexa et al. 2003) with 20 neighbours. If the noise is as
    large as the point spacing, a ball that should roll along a wall gets stuck inside it; smoothing makes
    the wall thin again. Points move along normals only, so their density does not change.

    Args:
        cloud: points with normals; the new normals keep their orientation.
        passes: number of passes; 0 changes nothing.
        rows: (M,) rows of the points to return; None for all.
    """
    for _ in range(passes - 1):
        cloud = _pass(cloud, np.arange(len(cloud)))
    if passes:
        return _pass(cloud, np.arange(len(cloud)) if rows is None else rows)
    return cloud if rows is None else cloud.select(rows)


def _pass(cloud: PointCloud, rows: IntArray) -> PointCloud:
    """Smooth the points at (M,) rows once; the others serve as neighbours only."""
    kept = cloud.select(rows)
    if kept.normals is None or len(cloud) < 4:
        return kept
    points_m, normals = onto_patches(cloud.points_m, min(NEIGHBOURS, len(cloud)), KERNEL_SHARE, rows)
    normals *= np.where(np.sum(normals * kept.normals, axis=1, keepdims=True) < 0, -1.0, 1.0)
    return replace(kept, points_m=points_m, normals=normals)
