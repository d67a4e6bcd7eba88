"""The job that computes the capture range: the starts from which a race's methods arrive (SPEC 4.7)."""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import replace

import numpy as np

from app.compute.state import Spec
from app.compute.store import Store
from app.screens.fuse.methods import label_of
from app.screens.fuse.race_job import Contest, config_of, contest_of, race_key
from app.screens.fuse.view import CAPTURE_SHIFTS_M, CAPTURE_TURNS_DEG, CaptureView, Race, Start
from packetmesh.errors import InputError, ReconstructionError
from packetmesh.progress import Progress
from pipeline.config import RegistrationConfig
from pipeline.registration import register
from pipeline.types import FloatArray

MAP_POINTS = 2_000


def capture_job(store: Store, spec: Spec, race: Race) -> Generator[Progress, None, CaptureView]:
    """Register with each of the race's methods from every start of the map; the race's start is ignored.

    Raises:
        InputError: no reference pose is known, or as ``contest_of`` raises.
    """
    rig, nodes = yield from store.stages(spec, "rig", "nodes")
    race = replace(race, start=Start())

    def run() -> Generator[Progress, None, CaptureView]:
        contest = contest_of(rig, nodes, race)
        if contest.T_home is None:
            raise InputError(
                "The true poses of this scene are not known, so the capture range cannot be computed; "
                "show the race inferred on sensor instead."
            )
        config = replace(spec.config.node_registration, max_points=MAP_POINTS)
        cells = list(np.ndindex(len(race.rivals), len(CAPTURE_TURNS_DEG), len(CAPTURE_SHIFTS_M)))
        errors_m = np.full((len(race.rivals), len(CAPTURE_TURNS_DEG), len(CAPTURE_SHIFTS_M)), np.nan)
        for done, (lane, turn, shift) in enumerate(cells):
            label = label_of(race.rivals[lane])
            yield Progress(f"capture range: {label}, {done + 1} of {len(cells)}", done / len(cells))
            start = Start.towards(CAPTURE_TURNS_DEG[turn], 100.0 * CAPTURE_SHIFTS_M[shift], race.seed)
            settings = config_of(race, race.rivals[lane], config)
            errors_m[lane, turn, shift] = _end_error_m(contest, settings, contest.start_pose(start))
        return CaptureView(tuple(label_of(rival) for rival in race.rivals), errors_m)

    return (yield from store.remember(("capture", *race_key(spec), race), run))


def _end_error_m(contest: Contest, config: RegistrationConfig, T_start: FloatArray) -> float:
    """Return the final RMS distance from the reference position; that of the start if registration fails."""
    try:
        T = register(contest.source, contest.target, config, T_start).T_target_source
    except ReconstructionError:
        T = T_start
    error_m = contest.error_m(T)
    return float("nan") if error_m is None else error_m
