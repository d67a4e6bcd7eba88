"""The job that runs a race: up to four registration methods from the same disturbed start, step by step."""

from __future__ import annotations

from collections.abc import Generator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from app.compute.records import sample
from app.compute.state import Spec
from app.compute.store import Store
from app.screens.fuse.belief import Belief
from app.screens.fuse.job import true_pose
from app.screens.fuse.lens import Distances, Lens, lens_of, shades_of
from app.screens.fuse.methods import label_of
from app.screens.fuse.rooms import ROOMS
from app.screens.fuse.view import (
    PairHistogram,
    Race,
    RaceLane,
    RaceStep,
    RaceView,
    Reference,
    Rival,
    Start,
)
from packetmesh.errors import InputError, ReconstructionError
from packetmesh.progress import Progress
from pipeline.config import Method, RegistrationConfig
from pipeline.kernels import geometry
from pipeline.nodes import NodeClouds
from pipeline.registration import average_hausdorff_m, point_error_m, register_timed
from pipeline.registration.degradation import Degradation, degrade
from pipeline.spec import key
from pipeline.types import FloatArray, PointCloud, RegistrationStep, Rig

LANE_POINTS = 10_000
"""Number of drawn points of each cloud of a lane."""
DRAWN_PAIRS = 250
BINS = 60
MOST_BINNED_M = 1.0
ERROR_POINTS, HAUSDORFF_POINTS = 2_000, 4_000
KERNEL_METHODS: tuple[Method, ...] = ("ceicp-n", "ceicp-a", "ceicp-r")
"""Methods that weigh a pair by -p log p, with p proportional to f(d) = exp(-d^2 / 2 sigma^2)."""


@dataclass(frozen=True, slots=True)
class Contest:
    """Two clouds, and the reference pose of the source."""

    source: PointCloud
    """The source cloud with the race's degradation."""
    target: PointCloud
    T_aligned: FloatArray
    """(4, 4) T_target_source: the reference pose, or the nodes' believed one if it is unknown."""
    T_home: FloatArray | None
    """(4, 4) reference pose; a reflection for a mirrored source. None if it is unknown."""
    reference: Reference
    center_m: FloatArray
    """(3,) centre of the aligned source before it was degraded, target frame."""
    error_points_m: FloatArray
    """(N, 3) points before degradation whose distance from their reference positions is the error."""
    T_world_target: FloatArray
    """(4, 4) pose of the target."""
    from_cameras: tuple[bool, bool]
    """Whether source and target are a camera's own measurement, so that they show its free space."""

    def start_pose(self, start: Start) -> FloatArray:
        """Return (4, 4) T_target_source of a start: the aligned pose with the start's error."""
        rotation = geometry.rotation_exp(np.radians(start.turn_deg))
        shift_m = self.center_m - rotation @ self.center_m + np.array(start.shift_cm) / 100.0
        return geometry.rigid(rotation, shift_m) @ self.T_aligned

    def error_m(self, T: FloatArray) -> float | None:
        """Return the RMS distance, m, of the points at a (4, 4) pose from the reference; None if unknown."""
        return None if self.T_home is None else point_error_m(T, self.T_home, self.error_points_m)


def race_job(store: Store, spec: Spec, race: Race) -> Generator[Progress, None, RaceView]:
    """Register with every method of a race from the same start; returns the race for display.

    Raises:
        InputError: the nodes or the degradation are not possible.
    """
    rig, nodes = yield from store.stages(spec, "rig", "nodes")

    def run() -> Generator[Progress, None, RaceView]:
        contest = contest_of(rig, nodes, race)
        runs = []
        for index, rival in enumerate(race.rivals):
            yield Progress(f"race: {label_of(rival)}", 0.9 * index / len(race.rivals))
            runs.append(_run(contest, race, rival, spec.config.node_registration))
        edges_m = _edges_m([run.records for run in runs])
        source = sample(contest.source.points_m, contest.source.colors, LANE_POINTS)
        distances = Distances(source.points_m, contest.T_home, cKDTree(contest.target.points_m))
        yield Progress("race: a corner to magnify", 0.9)
        lens = lens_of(contest.source.points_m, contest.target.points_m, contest.T_aligned, distances)
        yield Progress("race: whether to believe the answers", 0.95)
        clouds = contest.source, contest.target
        belief = Belief(*clouds, spec.config.node_registration, contest.from_cameras)
        return RaceView(
            source=source,
            target=sample(contest.target.points_m, contest.target.colors, LANE_POINTS),
            T_world_target=contest.T_world_target,
            center_m=contest.center_m,
            edges_m=edges_m,
            lens=None if lens is None else lens.view,
            reference=contest.reference,
            lanes=tuple(_lane(contest, run, Watch(edges_m, distances, lens), belief) for run in runs),
        )

    return (yield from store.remember(("race", *race_key(spec), race), run))


def race_key(spec: Spec) -> tuple[object, ...]:
    """Return the key of what a race's result depends on besides the race: clouds and settings."""
    return (key(spec, "nodes"), spec.config.node_registration)


def contest_of(rig: Rig, nodes: Sequence[NodeClouds], race: Race) -> Contest:
    """Return the clouds of a race and their reference pose.

    Raises:
        InputError: the scene has no such node, source and target are the same node, or the source has points
            behind its camera and cannot be degraded.
    """
    if race.mode in ROOMS:
        return _contest_in_room(race)
    last = max(race.source, race.target)
    if last >= len(nodes):
        raise InputError(
            f"This scene has no node number {last}, only 0 to {len(nodes) - 1}; choose another node."
        )
    moving = nodes[race.source]
    if race.mode == "inferred":
        source, target = moving.inferred, moving.sensor
        T_home: FloatArray | None = np.eye(4)
        reference: Reference = "pixels"
    else:
        if race.source == race.target:
            raise InputError(f"{moving.name} cannot be moved onto itself; choose another node.")
        source, target = moving.sensor, nodes[race.target].sensor
        T_home = true_pose(rig, race.source, race.target)
        reference = "cloud" if T_home is None else "truth"
    staying = race.source if race.mode == "inferred" else race.target
    poses = [frame.T_world_camera for frame in rig.frames]
    T_aligned = geometry.inverse(poses[race.target]) @ poses[race.source] if T_home is None else T_home
    if reference == "cloud" and rig.walk is not None:
        T_home, reference = T_aligned, "walk"
    measured = (race.mode == "nodes", True)
    return _contest(race, source, target, T_aligned, T_home, reference, poses[staying], measured)


def _contest_in_room(race: Race) -> Contest:
    scans = ROOMS[race.mode]()
    return _contest(
        race,
        scans.source,
        scans.target,
        scans.T_aligned,
        scans.T_home,
        "truth",
        scans.T_room_target,
        (False, False),
    )


def _contest(
    race: Race,
    source: PointCloud,
    target: PointCloud,
    T_aligned: FloatArray,
    T_home: FloatArray | None,
    reference: Reference,
    T_world_target: FloatArray,
    from_cameras: tuple[bool, bool],
) -> Contest:
    how = Degradation(
        noise_m=race.noise_m,
        outlier_share=race.outlier_share,
        hole_share=race.hole_share,
        depth_bias=race.depth_bias,
        crop_share=race.crop_share,
    )
    plain = how == Degradation()
    return Contest(
        source=source if plain else degrade(source, how, race.seed),
        target=target,
        T_aligned=T_aligned,
        T_home=T_home,
        reference=reference,
        center_m=geometry.apply(T_aligned, source.points_m.mean(axis=0, keepdims=True))[0],
        error_points_m=_every(source.points_m, ERROR_POINTS),
        T_world_target=T_world_target,
        from_cameras=(from_cameras[0] and plain, from_cameras[1]),
    )


def config_of(race: Race, rival: Rival, config: RegistrationConfig) -> RegistrationConfig:
    """Return the chain's settings with a rival's method."""
    method, metric = rival
    return replace(
        config, method=method, metric=metric, direction=race.direction, with_scale=False, start="given"
    )


def _every(points_m: FloatArray, most: int) -> FloatArray:
    """Return evenly spaced points in their order: fewer than twice ``most``, or all if they are fewer."""
    return points_m[:: max(1, len(points_m) // most)]


@dataclass(frozen=True, slots=True)
class Watch:
    """Data from which every step records its histogram, colours and magnified corner."""

    edges_m: FloatArray
    """(B + 1,) edges of the histogram's bins."""
    distances: Distances
    lens: Lens | None

    def seen(self, T_target_source: FloatArray) -> dict[str, Any]:
        """Return by name the fields ``gap_m``, ``shades`` and ``lens`` of a step at a (4, 4) pose."""
        distances_m, gap_m = self.distances.at(T_target_source)
        lens = np.empty((0, 3), np.uint8) if self.lens is None else self.lens.at(T_target_source)
        return {"gap_m": gap_m, "shades": shades_of(distances_m), "lens": lens}


@dataclass(frozen=True, slots=True)
class _Run:
    """The recorded run of a rival."""

    rival: Rival
    T_start: FloatArray
    records: tuple[RegistrationStep, ...]
    seconds: FloatArray
    reason: str


def _run(contest: Contest, race: Race, rival: Rival, config: RegistrationConfig) -> _Run:
    T_start = contest.start_pose(race.start)
    settings = config_of(race, rival, config)
    try:
        result, seconds = register_timed(contest.source, contest.target, settings, T_start)
    except ReconstructionError as error:
        return _Run(rival, T_start, (), np.empty(0), str(error))
    return _Run(rival, T_start, result.steps, seconds, result.stop_reason)


def _edges_m(runs: Sequence[Sequence[RegistrationStep]]) -> FloatArray:
    """Return (B + 1,) edges of bins for 97 % of the first pairs of every method, from 0 to at most 1 m."""
    reaches_m = [float(np.percentile(records[0].distances_m, 97)) for records in runs if records]
    return np.linspace(0.0, min(max([0.1, *reaches_m]), MOST_BINNED_M), BINS + 1)


def _lane(contest: Contest, run: _Run, watch: Watch, belief: Belief) -> RaceLane:
    steps, T, time_s = [], run.T_start, 0.0
    for record, done_s in zip(run.records, run.seconds, strict=True):
        steps.append(_race_step(record, T, time_s, contest, watch))
        T, time_s = record.T_target_source, float(done_s)
    steps.append(_end_step(steps[-1] if steps else None, T, time_s, contest, watch))
    moved_m = geometry.apply(T, _every(contest.source.points_m, HAUSDORFF_POINTS))
    verdict = belief.verdict(T)
    return RaceLane(
        rival=run.rival,
        label=label_of(run.rival),
        kernel=run.rival[0] in KERNEL_METHODS,
        steps=tuple(steps),
        stop_reason=run.reason,
        iterations=len(run.records),
        elapsed_s=time_s,
        average_hausdorff_m=average_hausdorff_m(moved_m, _every(contest.target.points_m, HAUSDORFF_POINTS)),
        effective_pairs=run.records[-1].effective_pairs if run.records else 0.0,
        verdict=verdict.word,
        reasons=verdict.reasons,
    )


def _race_step(
    record: RegistrationStep, T: FloatArray, time_s: float, contest: Contest, watch: Watch
) -> RaceStep:
    rows = np.unique(np.linspace(0, len(record.pairs) - 1, min(DRAWN_PAIRS, len(record.pairs))).astype(int))
    pairs, weights = record.pairs[rows], record.weights[rows]
    return RaceStep(
        T_target_source=T,
        source_points_m=contest.source.points_m[pairs[:, 0]].astype(np.float32),
        target_points_m=contest.target.points_m[pairs[:, 1]].astype(np.float32),
        weights=weights / max(float(record.weights.max()), 1e-12),
        time_s=time_s,
        rmse_m=record.rmse_m,
        entropy_nat=record.entropy_nat,
        point_error_m=contest.error_m(T),
        histogram=_histogram(record, watch.edges_m),
        **watch.seen(T),
    )


def _end_step(
    last: RaceStep | None, T: FloatArray, time_s: float, contest: Contest, watch: Watch
) -> RaceStep:
    """Return the step of the pose after the last update, with the numbers of the last matching."""
    nothing, unknown = np.empty((0, 3), np.float32), float("nan")
    histogram = PairHistogram(np.zeros(BINS, int), np.full(BINS, np.nan), unknown)
    return RaceStep(
        T_target_source=T,
        source_points_m=nothing,
        target_points_m=nothing,
        weights=np.empty(0),
        time_s=time_s,
        rmse_m=unknown if last is None else last.rmse_m,
        entropy_nat=unknown if last is None else last.entropy_nat,
        point_error_m=contest.error_m(T),
        histogram=histogram if last is None else last.histogram,
        **watch.seen(T),
    )


def _histogram(record: RegistrationStep, edges_m: FloatArray) -> PairHistogram:
    bins = np.clip(np.searchsorted(edges_m, record.distances_m, side="right") - 1, 0, BINS - 1)
    counts = np.bincount(bins, minlength=BINS)
    sums = np.bincount(bins, record.weights, minlength=BINS)
    means = np.divide(sums, counts, out=np.full(BINS, np.nan), where=counts > 0)
    return PairHistogram(counts, means / max(float(np.nanmax(means)), 1e-12), record.sigma_m)
