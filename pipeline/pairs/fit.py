"""Check of a registration's fit against the spacing of the points, and a search for mirrored clouds."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from packetmesh.errors import PacketMeshError
from pipeline.config import RegistrationConfig
from pipeline.kernels.geometry import apply
from pipeline.kernels.kdtree import tree_of
from pipeline.kernels.point_sets import middle_extent_m
from pipeline.pairs.register import DEFAULT_METHOD, Answer, Pair, run_methods
from pipeline.registration.global_start import default_voxel_m, global_start
from pipeline.types import FloatArray, PointCloud

BAD_FIT = 2.5
"""An RMSE above so many spacings of the points is a bad fit; two samples of one surface have about one."""
_CLEARLY_BETTER = 0.5
"""A mirrored source must lower the RMSE to this share."""
_FEW = 0.3
"""With a smaller share of source points on the target, and a bad fit, the clouds may not fit at all. Clouds
that overlap in part have bad fits too, as points beside the overlap count up to the limit."""
_WIDE = 0.2
"""Distances count up to this share of the target's extent, if the gate is smaller: it hides a bad fit."""
_CLOSE = 2.0
"""Points within so many spacings of the target count as on it."""
_SAMPLED = 10_000


class _Fit:
    """Distances of source points from a target, for sources that differ by a reflection."""

    def __init__(self, pair: Pair, gate_m: float) -> None:
        self._tree = tree_of(pair.target.points_m)
        self._limit_m = max(gate_m, _WIDE * middle_extent_m(pair.target.points_m))
        self.spacing_m = max(self._spacing_m(cloud) for cloud in (pair.source, pair.target))
        """Root mean square distance of points to their nearest other point, in the sparser cloud."""

    def __call__(self, source: PointCloud, T_target_source: FloatArray) -> tuple[float, float]:
        """Return the RMSE within the limit, in metres, and the share of source points on the target."""
        distances_m = self._tree.nearest(apply(T_target_source, _some_m(source)), 1)[0][:, 0]
        return self._rms_m(distances_m), float(np.mean(distances_m <= _CLOSE * self.spacing_m))

    def _spacing_m(self, cloud: PointCloud) -> float:
        return self._rms_m(tree_of(cloud.points_m).nearest(_some_m(cloud), 2)[0][:, 1])

    def _rms_m(self, distances_m: FloatArray) -> float:
        """Return the root mean square of the distances within the limit."""
        within_m = distances_m[distances_m <= self._limit_m]
        return float(np.sqrt(np.mean(within_m**2))) if len(within_m) else float("inf")


def fit_doubt(pair: Pair, answer: Answer, config: RegistrationConfig) -> str | None:
    """Return a sentence about a bad fit, or None; a mirrored source is looked for.

    Args:
        pair: the clouds.
        answer: the answer that counts, with a pose.
        config: settings of the registration, with its gate.
    """
    fit = _Fit(pair, config.gate_m)
    assert answer.T_target_source is not None
    rmse_m, share = fit(pair.source, answer.T_target_source)
    if rmse_m <= BAD_FIT * fit.spacing_m:
        return None
    text = f"rmse {100.0 * rmse_m:.1f} cm where points are {100.0 * fit.spacing_m:.1f} cm apart"
    limit_m = min(_CLEARLY_BETTER * rmse_m, BAD_FIT * fit.spacing_m)
    few = share < _FEW
    for axis, mirrored_m in _mirrored_fits(pair, config, fit, few):
        if mirrored_m < limit_m:
            return (
                f"No motion brings these clouds together ({text}), because one is mirrored: with {axis} "
                f"negated the source fits to {100.0 * mirrored_m:.1f} cm; try to export it in right-handed "
                f"coordinates, or negate its {axis}"
            )
    if not few:
        return None
    return (
        f"The fit is bad: {text}, and only {100.0 * share:.0f} % of the source points are near the target. "
        "Unless the clouds overlap so little, no motion that was tried brings them together; check that they "
        "show the same place in the same unit, and try --start global"
    )


def _some_m(cloud: PointCloud) -> FloatArray:
    """Return every k-th point of a cloud."""
    return cloud.points_m[:: max(1, len(cloud) // _SAMPLED)]


def _mirrored_fits(
    pair: Pair, config: RegistrationConfig, fit: _Fit, anywhere: bool
) -> Iterator[tuple[str, float]]:
    """Yield the negated axis and the RMSE of mirrored sources, in metres."""
    config = replace(config, method=DEFAULT_METHOD, start="given")
    for axis, mirrored in _mirrored(pair, config.seed, anywhere):
        found = next(run_methods((DEFAULT_METHOD,), mirrored, config))
        if not found.failed and found.T_target_source is not None:
            yield axis, fit(mirrored.source, found.T_target_source)[0]


def _mirrored(pair: Pair, seed: int, anywhere: bool) -> Iterator[tuple[str, Pair]]:
    """Yield pairs with a source mirrored at the origin, at its middle, and ``anywhere`` by features."""
    middle_m = np.median(pair.source.points_m, axis=0)
    for axis, name in enumerate("xyz"):
        for center_m in (0.0, float(middle_m[axis])):
            yield name, replace(pair, source=_negated(pair.source, axis, center_m))
    if not anywhere:
        return
    source = _negated(pair.source, 0, 0.0)
    try:
        T_start = global_start(source, pair.target, default_voxel_m(pair.target), seed)
    except PacketMeshError:
        return
    yield "x", Pair(source, pair.target, T_start)


def _negated(cloud: PointCloud, axis: int, center_m: float) -> PointCloud:
    """Return a cloud mirrored at the plane where a coordinate is ``center_m``."""
    points_m = cloud.points_m.copy()
    points_m[:, axis] = 2.0 * center_m - points_m[:, axis]
    normals = None if cloud.normals is None else cloud.normals * np.where(np.arange(3) == axis, -1.0, 1.0)
    return replace(cloud, points_m=points_m, normals=normals)
