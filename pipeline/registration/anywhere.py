"""Registration without a start pose: several start poses are tried and compared by a given score."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from scipy.spatial import cKDTree

from packetmesh.errors import ReconstructionError
from pipeline.config import RegistrationConfig
from pipeline.kernels.geometry import apply
from pipeline.registration.global_start import default_voxel_m, global_start
from pipeline.registration.loop import register
from pipeline.registration.neighbourhood import median_spacing_m, pca_normals
from pipeline.registration.observability import open_motions
from pipeline.registration.sample import draw
from pipeline.types import FloatArray, PointCloud, RegistrationResult

VOXELS = (1.6, 1.0)
"""Voxel sizes of the tried start poses, in default voxels: the coarse one is the fastest."""
SHAPE_POINTS = 3000
MEETING_SPACINGS = 3.0
"""The clouds overlap at points that are nearer to the other cloud than this many spacings."""


def register_anywhere(
    source: PointCloud,
    target: PointCloud,
    config: RegistrationConfig,
    score: Callable[[FloatArray], float],
    enough: float,
    thorough: bool = True,
) -> RegistrationResult:
    """Register from start poses found with features of two sizes; returns the result with the best score.

    Args:
        source: the cloud that moves.
        target: the cloud that stays.
        config: settings of the registration from each start pose.
        score: maps a (4, 4) final pose T_target_source to a number, the larger the better. It should use
            other evidence than nearest points, because a wrong pose can bring these together as well.
        enough: score at which the search stops.
        thorough: whether features of the second size are tried if those of the first do not reach ``enough``.

    Raises:
        ReconstructionError: no start pose was found, or the overlapping surfaces leave a motion undetermined.
    """
    best: tuple[float, RegistrationResult] | None = None
    reason = ""
    for voxels in VOXELS if thorough else VOXELS[:1]:
        try:
            T_start = global_start(source, target, voxels * default_voxel_m(target), config.seed)
            result = register(source, target, replace(config, start="given"), T_start)
        except ReconstructionError as error:
            reason = str(error)
            continue
        if motions := _open_where_they_meet(source, target, result.T_target_source, config.seed):
            reason = f"Where the clouds lie on each other, {motions} changes nothing; give a start pose."
            continue
        scored = score(result.T_target_source)
        if best is None or scored > best[0]:
            best = scored, result
        if scored >= enough:
            break
    if best is None:
        raise ReconstructionError(reason)
    return best[1]


def _open_where_they_meet(source: PointCloud, target: PointCloud, T: FloatArray, seed: int) -> str:
    """Return the motions, in words, that the overlap of both clouds at a pose does not determine."""
    moving, fixed = (draw(cloud, SHAPE_POINTS, seed, "").points_m for cloud in (source, target))
    reach_m = MEETING_SPACINGS * median_spacing_m(fixed)
    distances_m, _ = cKDTree(apply(T, moving)).query(fixed, distance_upper_bound=reach_m, workers=-1)
    met = np.isfinite(distances_m)
    return open_motions(fixed[met], pca_normals(fixed)[met]) if met.any() else ""
