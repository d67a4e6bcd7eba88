"""Two registration methods from the same disturbed start, step by step."""

from __future__ import annotations

import time
from collections.abc import Generator
from dataclasses import replace

import numpy as np

from app.jobs.chain import prepared, rig_of
from app.jobs.records import Race, RaceLane, RaceStep, RaceView, sample
from app.jobs.store import Store
from app.jobs.views import true_pose
from app.state import Spec
from pipeline import geometry
from pipeline.config import RegistrationConfig
from pipeline.errors import InputError, ReconstructionError
from pipeline.progress import Progress
from pipeline.registration import iterate, point_error_m
from pipeline.types import FloatArray, PointCloud, RegistrationStep, Rig

LANE_POINTS = 15_000
DRAWN_PAIRS = 250


def race_job(store: Store, spec: Spec, race: Race) -> Generator[Progress, None, RaceView]:
    """Run every rival from the same start."""
    rig = yield from rig_of(store, spec)
    work = yield from prepared(store, spec)
    if race.source == race.target:
        raise InputError(f"{rig.frames[race.source].name} cannot be moved onto itself; choose another node.")
    config = spec.config.node_registration
    source, target = work.nodes[race.source].sensor, work.nodes[race.target].sensor

    def run() -> Generator[Progress, None, RaceView]:
        T_start = start_pose(rig, race, source)
        T_true = true_pose(rig, race.source, race.target)
        lanes = []
        for index, (method, metric) in enumerate(race.rivals):
            yield Progress(f"race: {method}, {metric}", index / len(race.rivals))
            rival = replace(config, method=method, metric=metric, direction=race.direction, with_scale=False)
            lanes.append(_lane(source, target, rival, T_start, T_true))
        return RaceView(
            source_name=rig.frames[race.source].name,
            target_name=rig.frames[race.target].name,
            source=sample(source.points_m, source.colors, LANE_POINTS),
            target=sample(target.points_m, target.colors, LANE_POINTS),
            T_world_target=rig.frames[race.target].T_world_camera,
            lanes=tuple(lanes),
        )

    return (yield from store.remember(("race", *spec.key("depth"), config, race), run))


def start_pose(rig: Rig, race: Race, source: PointCloud) -> FloatArray:
    """T_target_source as the nodes believe it, disturbed in a direction drawn by the seed."""
    poses = [frame.T_world_camera for frame in rig.frames]
    T_believed = geometry.inverse(poses[race.target]) @ poses[race.source]
    rng = np.random.default_rng(race.seed)
    axis, direction = (vector / np.linalg.norm(vector) for vector in rng.normal(size=(2, 3)))
    rotation = geometry.rotation_exp(axis * np.radians(race.rotation_deg))
    center_m = source.points_m.mean(axis=0)
    shift_m = center_m - rotation @ center_m + direction * race.translation_cm / 100.0
    return T_believed @ geometry.rigid(rotation, shift_m)


def _lane(
    source: PointCloud,
    target: PointCloud,
    config: RegistrationConfig,
    T_start: FloatArray,
    T_true: FloatArray | None,
) -> RaceLane:
    started = time.perf_counter()
    remaining, records = iterate(source, target, config, T_start), []
    while True:
        try:
            records.append(next(remaining))
        except StopIteration as end:
            reason = str(end.value)
            break
        except ReconstructionError as error:
            reason = str(error)
            break
    elapsed_s = time.perf_counter() - started
    error_points_m = source.points_m[:: max(1, len(source) // 2000)]

    def error_m(T: FloatArray) -> float | None:
        return None if T_true is None else point_error_m(T, T_true, error_points_m)

    steps, T = [], T_start
    for record in records:
        steps.append(_race_step(record, T, source, target, error_m(T)))
        T = record.T_target_source
    nothing = np.empty((0, 3), np.float32)
    last_rmse_m = records[-1].rmse_m if records else float("nan")
    steps.append(RaceStep(T, nothing, nothing, np.empty(0), last_rmse_m, error_m(T)))
    label = f"{config.method.upper()} {config.metric}"
    return RaceLane(label, tuple(steps), reason, len(records), elapsed_s)


def _race_step(
    record: RegistrationStep, T: FloatArray, source: PointCloud, target: PointCloud, error_m: float | None
) -> RaceStep:
    rows = np.unique(np.linspace(0, len(record.pairs) - 1, min(DRAWN_PAIRS, len(record.pairs))).astype(int))
    pairs, weights = record.pairs[rows], record.weights[rows]
    return RaceStep(
        T_target_source=T,
        source_points_m=source.points_m[pairs[:, 0]].astype(np.float32),
        target_points_m=target.points_m[pairs[:, 1]].astype(np.float32),
        weights=weights / max(float(record.weights.max()), 1e-12),
        rmse_m=record.rmse_m,
        point_error_m=error_m,
    )
