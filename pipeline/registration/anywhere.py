"""Two clouds of which nothing is known: several start poses, judged by what lies behind the points."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from packetmesh.errors import ReconstructionError
from pipeline.config import RegistrationConfig
from pipeline.registration.global_start import default_voxel_m, global_start
from pipeline.registration.loop import register
from pipeline.types import FloatArray, PointCloud, RegistrationResult

VOXELS = (1.6, 1.0)
"""Voxels of the start poses tried, in default voxels: the coarse one is the quickest."""


def register_anywhere(
    source: PointCloud,
    target: PointCloud,
    config: RegistrationConfig,
    score: Callable[[FloatArray], float],
    enough: float,
    thorough: bool = True,
) -> RegistrationResult:
    """Register from start poses that features of two sizes give; the best by a score of the end pose.

    Args:
        source: the cloud that moves.
        target: the cloud that stays.
        config: how it goes on from a start pose.
        score: of a (4, 4) pose T_target_source; the larger the better, and better a check of other evidence
            than nearest points, which a wrong pose may bring together as well.
        enough: a score with which the search ends.
        thorough: whether features of the second size are tried where those of the first do not suffice.

    Raises:
        ReconstructionError: no start pose was found.
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
        scored = score(result.T_target_source)
        if best is None or scored > best[0]:
            best = scored, result
        if scored >= enough:
            break
    if best is None:
        raise ReconstructionError(reason)
    return best[1]
