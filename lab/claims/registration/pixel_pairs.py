"""The baseline for one camera's two clouds: points are paired by pixel, without matching."""

from __future__ import annotations

import numpy as np

from packetmesh.errors import ReconstructionError
from pipeline.kernels.geometry import apply
from pipeline.registration.residual import weighted_procrustes
from pipeline.types import FloatArray, IntArray, PointCloud

LEAST_PAIRS = 6
MAX_ITERATIONS = 50
TUKEY_WIDTH = 4.685 * 1.4826
"""Ratio of the cutoff to the median distance: pairs beyond the cutoff have no weight."""
STILL = 1e-9
"""Largest change of the pose's entries at convergence."""


def pixel_pair_poses(source: PointCloud, target: PointCloud) -> tuple[FloatArray, ...]:
    """Register one camera's two clouds by robust Procrustes on pairs of equal pixels (SPEC 4.6).

    Tukey's biweight weighs the pairs.

    Args:
        source: the cloud that moves; both clouds have pixels.
        target: the cloud that stays, of the same camera.

    Returns:
        (4, 4) T_target_source after every iteration.

    Raises:
        ReconstructionError: a cloud has no pixels, both share fewer than 6, or those points are collinear.
    """
    source_m, target_m = (
        cloud.points_m[rows]
        for cloud, rows in zip((source, target), shared_pixels(source, target), strict=True)
    )
    if len(source_m) < LEAST_PAIRS:
        raise ReconstructionError(
            f"The clouds share {len(source_m)} pixels, and pixel pairs take {LEAST_PAIRS}: take more points."
        )
    weights = np.ones(len(source_m))
    poses: list[FloatArray] = []
    while len(poses) < MAX_ITERATIONS:
        T = weighted_procrustes(source_m, target_m, weights)
        settled = bool(poses) and np.abs(T - poses[-1]).max() < STILL
        poses.append(T)
        if settled:
            break
        distance_m = np.linalg.norm(apply(T, source_m) - target_m, axis=1)
        width_m = max(TUKEY_WIDTH * float(np.median(distance_m)), np.finfo(float).tiny)
        weights = np.clip(1.0 - (distance_m / width_m) ** 2, 0.0, None) ** 2
    return tuple(poses)


def shared_pixels(source: PointCloud, target: PointCloud) -> tuple[IntArray, IntArray]:
    """Return (M,) rows of both clouds whose points come from the same pixel."""
    _, source_rows, target_rows = np.intersect1d(_keys(source), _keys(target), return_indices=True)
    return source_rows, target_rows


def _keys(cloud: PointCloud) -> IntArray:
    """Return (N,) an integer that identifies each point's pixel."""
    if cloud.pixels is None:
        raise ReconstructionError("Pixel pairs need clouds that know their pixels.")
    return cloud.pixels[:, 0].astype(np.int64) << 32 | cloud.pixels[:, 1].astype(np.int64)
