"""Registration of any two clouds: their checks, and the answers of our methods and of the peers."""

from __future__ import annotations

import logging
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from scipy.spatial import cKDTree

from packetmesh.errors import InputError, PacketMeshError, ReconstructionError
from pipeline.config import Metric, RegistrationConfig
from pipeline.kernels.geometry import apply
from pipeline.kernels.point_sets import distinct_rows, middle_extent_m
from pipeline.pairs.units import check_units, unit_advice
from pipeline.registration import average_hausdorff_m, point_error_m, register_timed
from pipeline.registration.finding.evidence import Evidence
from pipeline.registration.finding.poses import length
from pipeline.registration.finding.starts import Way
from pipeline.registration.finding.verdict import Verdict
from pipeline.registration.methods import METHODS
from pipeline.registration.neighbourhood import pca_normals
from pipeline.registration.observability import open_motions
from pipeline.registration.peers import PEERS, available_peers, run_peer
from pipeline.surface.given_normals import without_bad_normals
from pipeline.surface.voxel import voxel_average, voxel_for_count
from pipeline.types import FloatArray, PointCloud, RegistrationStep

_log = logging.getLogger(__name__)

ALL = "all"
DEFAULT_METHOD = "ceicp-a"
ALIASES = {"ceicp": DEFAULT_METHOD}
LEAST_POINTS = 6
LARGEST_M, SMALLEST_M = 1000.0, 0.001
"""Plausible extents of a cloud in metres."""
_MOST_EXTENTS = 1e4
"""A point farther from the median than this many extents of the cloud is an error of measurement."""
EVALUATED_POINTS = 20_000
"""Both clouds are thinned to about this many points before their distance is measured."""
SHAPE_POINTS = 3000
"""Most points of the target by which its shape is checked."""


@dataclass(frozen=True, slots=True)
class Answer:
    """Result of one method on a pair; ``T_target_source`` is None if it failed."""

    method: str
    T_target_source: FloatArray | None
    """(4, 4) final pose."""
    iterations: int | None
    """Number of iterations; None if a peer does not report it."""
    stop_reason: str
    elapsed_s: float
    """Run time; NaN if the method failed."""
    rmse_m: float = float("nan")
    """Root mean square distance of the moved source points from the target, within the gate; computed
    in the same way for every method."""
    average_hausdorff_m: float = float("nan")
    """Average Hausdorff distance of both clouds, thinned equally (SPEC 4.7)."""
    point_error_m: float = float("nan")
    """Point error against the true pose; NaN if this is unknown."""
    steps: tuple[RegistrationStep, ...] = ()
    """Steps of the method; empty for peers."""
    step_times_s: tuple[float, ...] = ()
    """Time since the start at each step."""
    draws: int = 1
    """Number of draws of the points whose registrations were compared; 1 without this comparison."""
    spread_m: float = float("nan")
    """Largest point error between the search's pose and the registrations that checked it; infinite if one
    failed, NaN without any."""
    verdict: Verdict | None = None
    """Whether to believe the pose; None if the answer was not judged."""
    evidence: Evidence | None = None
    """Evidence of the clouds for and against the pose; None if the answer was not judged."""
    way: Way | None = None
    """Where the start pose came from; None if the answer was not judged."""

    @property
    def failed(self) -> bool:
        """Whether there is no pose, or the points do not determine it."""
        return self.T_target_source is None or self.stop_reason.startswith("degenerate")


@dataclass(frozen=True, slots=True)
class Pair:
    """Two clouds to register."""

    source: PointCloud
    target: PointCloud
    T_init: FloatArray
    """(4, 4) start pose T_target_source."""
    T_true: FloatArray | None = None


def chosen_methods(name: str) -> tuple[str, ...]:
    """Return the methods with this name; ``all`` means every method and every installed peer.

    Raises:
        InputError: there is no such method; the message lists them.
    """
    known = (*METHODS, *available_peers())
    if name == ALL:
        return known
    name = ALIASES.get(name, name)
    if name not in known:
        raise InputError(f"There is no method '{name}'; try one of {', '.join((ALL, *ALIASES, *known))}")
    return (name,)


def config_for(
    methods: tuple[str, ...],
    metric: Metric | None,
    gate_m: float | None,
    start: Literal["given", "global"],
    with_scale: bool,
) -> RegistrationConfig:
    """Return the settings of a comparison.

    A scale needs the point metric and pairs in both directions: with one direction, shrinking the source
    would bring its points nearer to their partners. Without ``metric`` it is ``plane``, or ``point`` with a
    scale. Without ``gate_m`` the default gate is set, which ``find_place`` replaces.

    Raises:
        InputError: the settings contradict each other.
    """
    method = methods[0] if len(methods) == 1 and methods[0] in METHODS else DEFAULT_METHOD
    return RegistrationConfig(
        method=method,
        metric=metric or ("point" if with_scale else "plane"),
        gate_m=RegistrationConfig().gate_m if gate_m is None else gate_m,
        start=start,
        with_scale=with_scale,
        direction="both" if with_scale else "q2p",
    )


def prepared_cloud(
    cloud: PointCloud,
    name: Literal["source", "target"],
    voxel_m: float | None,
    metres_per_unit: tuple[float, float] | None = None,
) -> PointCloud:
    """Remove repeated points, strays and bad normals, then average over voxels of edge ``voxel_m`` if given.

    Args:
        cloud: any cloud, in metres.
        name: which of the two clouds it is, for messages.
        voxel_m: edge of the voxels; None keeps all points.
        metres_per_unit: the metres per unit of source and target that the user has given.

    Raises:
        InputError: there are fewer than six distinct points, or the size is implausible in metres.
    """
    first = distinct_rows(cloud.points_m)
    if len(first) < LEAST_POINTS:
        raise InputError(
            f"The {name} cloud has {len(first)} distinct points; registration needs at least {LEAST_POINTS}, "
            "so check its file"
        )
    if len(first) < len(cloud):
        _log.warning("%d repeated points of the %s cloud are left out", len(cloud) - len(first), name)
        cloud = cloud.select(first)
    extent_m = middle_extent_m(cloud.points_m)
    if not SMALLEST_M <= extent_m <= LARGEST_M:
        unit, metres = ("millimetres", 0.001) if extent_m > LARGEST_M else ("kilometres", 1000.0)
        advice = unit_advice({"source": metres, "target": metres}, metres_per_unit)
        raise InputError(
            f"The {name} cloud is {length(extent_m)} across, as if its numbers were {unit}, and clouds from "
            f"{SMALLEST_M:g} to {LARGEST_M:g} m can be registered; {advice} if both are in {unit}"
        )
    cloud = _without_strays(cloud, name, _MOST_EXTENTS * extent_m)
    cloud = without_bad_normals(cloud, name)
    return cloud if voxel_m is None else voxel_average(cloud, voxel_m)


def _without_strays(cloud: PointCloud, name: str, farthest_m: float) -> PointCloud:
    """Return the points whose coordinates are all within ``farthest_m`` of the median."""
    near = np.abs(cloud.points_m - np.median(cloud.points_m, axis=0)).max(axis=1) <= farthest_m
    if near.all():
        return cloud
    _log.warning(
        "%d points of the %s cloud are left out: they are more than %s from the others",
        (~near).sum(),
        name,
        length(farthest_m),
    )
    return cloud.select(near)


def prepared_pair(
    source: PointCloud,
    target: PointCloud,
    config: RegistrationConfig,
    voxel_m: float | None = None,
    T_init: FloatArray | None = None,
    T_true: FloatArray | None = None,
    metres_per_unit: tuple[float, float] | None = None,
) -> Pair:
    """Check and thin two clouds.

    Args:
        source: the cloud that moves.
        target: the cloud that stays.
        config: settings of the registration.
        voxel_m: edge of the cubes over which points are averaged, metres; None keeps all points.
        T_init: (4, 4) start pose T_target_source; None is the identity.
        T_true: (4, 4) true pose, if it is known.
        metres_per_unit: the metres per unit of source and target that the user has given, with which they
            were converted to metres.

    Raises:
        InputError: points cannot be used, or the clouds have different units.
        ReconstructionError: the target's shape leaves a motion open.
    """
    check_units(source, target, metres_per_unit, config.with_scale)
    source = prepared_cloud(source, "source", voxel_m, metres_per_unit)
    target = prepared_cloud(target, "target", voxel_m, metres_per_unit)
    _check_shape(target, config.seed)
    return Pair(source, target, np.eye(4) if T_init is None else T_init, T_true)


def run_methods(methods: tuple[str, ...], pair: Pair, config: RegistrationConfig) -> Iterator[Answer]:
    """Yield every method's answer from the same start pose; a failed method's stop reason names the error."""
    evaluate = _Evaluation(pair, config.gate_m)
    for name in methods:
        try:
            answer = _peer(name, pair, config) if name in PEERS else _ours(name, pair, config)
        except PacketMeshError as error:
            yield Answer(name, None, 0, f"failed: {error}", float("nan"))
            continue
        yield evaluate(answer)


def _ours(name: str, pair: Pair, config: RegistrationConfig) -> Answer:
    config = replace(config, method=name, start="given")
    result, times_s = register_timed(pair.source, pair.target, config, pair.T_init)
    elapsed_s = float(times_s[-1]) if len(times_s) else float("nan")
    T = result.T_target_source if result.steps else None
    times = tuple(map(float, times_s))
    return Answer(
        name, T, len(result.steps), result.stop_reason, elapsed_s, steps=result.steps, step_times_s=times
    )


def _peer(name: str, pair: Pair, config: RegistrationConfig) -> Answer:
    result = run_peer(name, pair.source, pair.target, config.gate_m, pair.T_init, config.max_iterations)
    return Answer(name, result.T_target_source, result.iterations, result.stop_reason, result.elapsed_s)


class _Evaluation:
    """Measures answers by the remaining distances, with clouds thinned and a tree built once."""

    def __init__(self, pair: Pair, gate_m: float) -> None:
        self._pair, self._gate_m = pair, gate_m
        voxel_m = voxel_for_count(pair.target.points_m, EVALUATED_POINTS)
        if max(len(pair.source), len(pair.target)) > EVALUATED_POINTS:
            thin = [
                voxel_average(PointCloud(cloud.points_m), voxel_m) for cloud in (pair.source, pair.target)
            ]
        else:
            thin = [pair.source, pair.target]
        self._source_m, self._target_m = thin[0].points_m, thin[1].points_m
        self._tree = cKDTree(self._target_m)

    def __call__(self, answer: Answer) -> Answer:
        """Return the answer with its distances."""
        if answer.T_target_source is None:
            return answer
        moved_m = apply(answer.T_target_source, self._source_m)
        distances_m = self._tree.query(moved_m, workers=-1)[0]
        close_m = distances_m[distances_m <= self._gate_m]
        T_true = self._pair.T_true
        return replace(
            answer,
            rmse_m=float(np.sqrt(np.mean(close_m**2))) if len(close_m) else float("nan"),
            average_hausdorff_m=average_hausdorff_m(moved_m, self._target_m),
            point_error_m=(
                float("nan")
                if T_true is None
                else point_error_m(answer.T_target_source, T_true, self._source_m)
            ),
        )


def _check_shape(target: PointCloud, seed: int) -> None:
    """Raise an error if some motion leaves the target's surface unchanged."""
    count = min(len(target), SHAPE_POINTS)
    rows = np.random.default_rng(seed).choice(len(target), count, replace=False)
    points_m = target.points_m[rows]
    motions = open_motions(points_m, pca_normals(points_m))
    if motions:
        raise ReconstructionError(
            f"The target cloud's shape does not determine the pose: {motions} changes nothing; "
            "try a cloud that shows more of the place"
        )
