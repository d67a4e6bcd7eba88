"""Choice of the gate from the data: several gates are tried, and one with the best fit is taken."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from packetmesh.errors import ReconstructionError
from pipeline.config import RegistrationConfig
from pipeline.kernels.geometry import apply
from pipeline.kernels.point_sets import middle_extent_m
from pipeline.registration.loop import register
from pipeline.registration.neighbourhood import median_spacing_m, pca_normals
from pipeline.registration.sample import draw
from pipeline.types import FloatArray, PointCloud

RUNGS = (1 / 20, 1 / 10, 1 / 5, 2 / 5)
"""Tried gates over the extent of the target: 0.3 to 2.4 m in a room of 6 m."""
LEAST_GATE_OF_SPACING = 6.0
"""Least gate, in median spacings of the sampled target points."""
LADDER_POINTS = 3000
"""Points of each cloud that are used to try the gates."""
FIT_OF_SPACING = 1.5
"""Limit of the misfit's distances, in median spacings of the sampled points."""
ALIKE = 1.02
"""Largest ratio of two misfits that are taken as the same pose."""


class Rung(NamedTuple):
    """One tried gate with the pose that it leads to."""

    gate_m: float
    T_target_source: FloatArray
    misfit: float
    """Misfit of the clouds at this pose, 0 to 1."""


class Misfit:
    """Misfit of two clouds at a pose, 0 to 1; the same measure for every gate and method.

    It is the mean over the points of both clouds of min(d, limit)^2 / limit^2, where d is the distance to the
    other cloud's tangent plane at the nearest point, or the limit if that point is farther away. So more
    overlap and smaller residuals both lower it, and all far points count alike.
    """

    def __init__(self, source: PointCloud, target: PointCloud, seed: int = 0) -> None:
        """Sample the clouds at random with ``seed``, and prepare trees and normals."""
        self._points_m = [
            draw(cloud, 2 * LADDER_POINTS, seed, name).points_m
            for cloud, name in ((source, "source"), (target, "target"))
        ]
        self._trees = [cKDTree(points_m) for points_m in self._points_m]
        self._normals = [pca_normals(points_m) for points_m in self._points_m]
        self.limit_m = FIT_OF_SPACING * max(median_spacing_m(points_m) for points_m in self._points_m)

    def __call__(self, T_target_source: FloatArray) -> float:
        """Return the misfit at a (4, 4) pose."""
        there = self._squared(0, 1, T_target_source)
        back = self._squared(1, 0, np.linalg.inv(T_target_source))
        return float(np.mean(np.concatenate([there, back])))

    def _squared(self, moving: int, fixed: int, T: FloatArray) -> FloatArray:
        """Return (N,) min(d, limit)^2 / limit^2 of the moving cloud's points."""
        moved_m = apply(T, self._points_m[moving])
        distances_m, nearest = self._trees[fixed].query(
            moved_m, distance_upper_bound=self.limit_m, workers=-1
        )
        squared = np.ones(len(moved_m))
        near = np.flatnonzero(np.isfinite(distances_m))
        rows = nearest[near]
        arms_m = moved_m[near] - self._points_m[fixed][rows]
        along_m = np.einsum("ni,ni->n", arms_m, self._normals[fixed][rows])
        squared[near] = (along_m / self.limit_m) ** 2
        return squared


def ladder(
    source: PointCloud, target: PointCloud, config: RegistrationConfig, T_init: FloatArray, misfit: Misfit
) -> list[Rung]:
    """Register with CEICP-A and few points from a start pose, once with each of several gates.

    Args:
        source: the cloud that moves.
        target: the cloud that stays; its extent and its spacing determine the gates.
        config: metric, direction and seed; its gate is not used.
        T_init: (4, 4) start pose T_target_source.
        misfit: misfit of these two clouds.

    Raises:
        ReconstructionError: even the widest gate contains no pair.
    """
    extent_m = middle_extent_m(target.points_m)
    few = draw(target, config.max_points, config.seed, "target").points_m
    least_m = LEAST_GATE_OF_SPACING * median_spacing_m(few)
    few_points = replace(
        config, method="ceicp-a", start="given", max_points=min(LADDER_POINTS, config.max_points)
    )
    rungs: list[Rung] = []
    reason: ReconstructionError | None = None
    for gate_m in sorted({max(least_m, share * extent_m) for share in RUNGS}):
        quick = replace(few_points, gate_m=gate_m)
        try:
            result = register(source, target, quick, T_init)
        except ReconstructionError as error:
            reason = error
            continue
        if result.steps:
            rungs.append(Rung(gate_m, result.T_target_source, misfit(result.T_target_source)))
    if not rungs:
        raise reason or ReconstructionError(
            "The pairs at the start pose do not determine a motion; give a closer start pose."
        )
    return rungs


def best_gate_m(rungs: Sequence[Rung]) -> float:
    """Return the middle one of the gates with nearly the least misfit: its neighbours fit as well."""
    least = min(rung.misfit for rung in rungs)
    alike = [rung.gate_m for rung in rungs if rung.misfit <= ALIKE * least]
    return alike[(len(alike) - 1) // 2]
