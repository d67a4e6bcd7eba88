"""A plan: the next cameras of a rig, what they promise to add, and how sure that is (SPEC 12)."""

from __future__ import annotations

from collections.abc import Generator, Sequence
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np

from packetmesh.checks import at_least
from packetmesh.errors import InputError
from packetmesh.progress import Progress
from pipeline.planning.chances import Judged, judge
from pipeline.planning.choose import Choice, choose
from pipeline.planning.places import WHERES, Candidate, Where, candidates
from pipeline.planning.promise import Promise, promise
from pipeline.planning.seen import SeenPlace
from pipeline.planning.sensors import AS_PRESENT, Sensor, check_sensor
from pipeline.types import BoolArray, FloatArray

LEAST_OVERLAP = 0.25
"""Share of a candidate's image that one present camera must see, too, so that registration finds its pose."""
MOST_CAMERAS = 20
BY_HAND: Literal["by hand"] = "by hand"
"""Kind of place of a camera that was moved from the place of its plan."""


@dataclass(frozen=True, slots=True)
class PlanConfig:
    """Settings of a plan: number and kind of its cameras, and where they may stand."""

    cameras: int = 1
    """Cameras to be added."""
    sensor: str = AS_PRESENT
    """Name of their depth camera."""
    where: tuple[Where, ...] = field(default=WHERES)
    """Where they may stand."""
    dark_surface: bool = True
    """Whether surface counts that looks dark to a present sensor, where they may get no depth, either."""

    def __post_init__(self) -> None:
        at_least("cameras", self.cameras, 1)
        if self.cameras > MOST_CAMERAS:
            raise InputError(f"cameras is {self.cameras}; plan at most {MOST_CAMERAS} at a time")
        check_sensor(self.sensor)
        if not self.where:
            raise InputError(f"No camera may stand anywhere; allow one or more of {', '.join(WHERES)}")
        unknown = [kind for kind in self.where if kind not in WHERES]
        if unknown:
            raise InputError(f"No camera can stand on {unknown[0]!r}; try one of {', '.join(WHERES)}")


@dataclass(frozen=True, slots=True)
class PlannedCamera:
    """One camera of a plan."""

    T_world_camera: FloatArray
    where: Where | Literal["by hand"]
    promise: Promise
    """Its gain over the present cameras and those before it in the plan."""
    overlap_share: float
    """Share of its image on measured surface that one present camera sees, too."""


@dataclass(frozen=True, slots=True)
class Plan:
    """The next cameras, the most useful first."""

    config: PlanConfig
    sensor: Sensor
    cameras: tuple[PlannedCamera, ...]
    total: Promise
    """Gain of all of them together."""
    at_least_of_best: float
    """Lower bound on the plan's expected gain, as a share of the largest possible with these candidates."""
    candidates: int
    """Number of candidates that could be chosen: they could be registered, and none was barred."""
    barred: int
    """Number of candidates that could be registered, but were barred."""
    measured_share: float
    """Share of the present cameras' rays on measured surface, without the new cameras."""


@dataclass(frozen=True, slots=True)
class Candidates:
    """All candidates, judged; plans of any size are chosen from them."""

    candidates: tuple[Candidate, ...]
    chance: FloatArray
    """(C, T) float32 chance of each candidate to measure each target."""
    overlap_shares: FloatArray
    """(C,) share of each candidate's image on measured surface that one present camera sees, too."""
    allowed: BoolArray
    """(C,) True for candidates with enough overlap."""


def iterate_candidates(
    seen: SeenPlace, sensor: Sensor, where: Sequence[Where] = WHERES
) -> Generator[Progress, None, Candidates]:
    """Judge all candidates of a place.

    Raises:
        InputError: no place is allowed, or none is free.
    """
    found = candidates(seen, where)
    judged: list[Judged] = []
    for index, candidate in enumerate(found):
        if not index % 25:
            yield Progress(f"judging camera {index} of {len(found)}", index / len(found))
        judged.append(judge(seen, candidate.T_world_camera, sensor))
    overlap_shares = np.array([one.overlap_share for one in judged])
    return Candidates(
        found, np.stack([one.chance for one in judged]), overlap_shares, overlap_shares >= LEAST_OVERLAP
    )


def bright_only(judged: Candidates, seen: SeenPlace) -> Candidates:
    """Return the candidates of a place with their chances for ``without_dark(seen)``.

    The candidates stay those of the whole place, so the best plan has at least the bright part of any other.
    """
    return replace(judged, chance=judged.chance[:, seen.targets.dark_return == 0.0])


def plan_of(
    seen: SeenPlace, judged: Candidates, sensor: Sensor, config: PlanConfig, barred: Sequence[int] = ()
) -> Plan:
    """Choose the cameras of a plan.

    Args:
        seen: the place, ``without_dark`` if the config says so.
        judged: its candidates, judged for the sensor; ``bright_only`` if the config says so.
        sensor: the cameras' sensor.
        config: how many cameras.
        barred: rows of candidates that are not chosen, for example because no radio reaches them.

    Raises:
        InputError: no candidate overlaps with the present cameras, or none adds anything.
    """
    allowed = judged.allowed.copy()
    allowed[list(barred)] = False
    left_out = int(judged.allowed.sum() - allowed.sum())
    if not allowed.any():
        raise InputError(
            f"None of the {len(allowed)} possible places shows enough of what a present camera measures "
            f"(at least {LEAST_OVERLAP:.0%} of its image), so no new camera could be registered; allow more "
            "kinds of places, or a sensor with a wider lens"
        )
    stands_m = np.array([candidate.T_world_camera[:3, 3] for candidate in judged.candidates])
    place = np.unique(np.round(stands_m, 3), axis=0, return_inverse=True)[1].ravel()
    choice = choose(judged.chance, allowed, place, config.cameras)
    if not choice.rows:
        raise InputError(
            "No camera on these places would measure anything that is missing; allow more kinds of places"
            + ("" if config.dark_surface else ", or let dark surface count")
        )
    return Plan(
        config,
        sensor,
        tuple(_cameras(seen, judged, choice)),
        promise(choice.gains.sum(axis=0), seen.targets),
        min(1.0, choice.gain / choice.best_at_most),
        int(allowed.sum()),
        left_out,
        seen.measured_share,
    )


def moved_plan(
    seen: SeenPlace, plan: Plan, T_world_camera: Sequence[FloatArray], judged: Sequence[Judged]
) -> Plan:
    """Return a plan whose cameras were moved by hand, with the promises of their new places.

    Args:
        seen: the place.
        plan: the plan before.
        T_world_camera: (4, 4) pose of each camera, in the order of the plan.
        judged: chances and overlap of a camera at each of these poses.
    """
    targets = seen.targets
    missed: FloatArray = np.ones(len(targets.points_m))
    cameras = []
    for camera, pose, found in zip(plan.cameras, T_world_camera, judged, strict=True):
        where = camera.where if np.array_equal(pose, camera.T_world_camera) else BY_HAND
        gain = promise(missed * found.chance, targets)
        cameras.append(PlannedCamera(pose, where, gain, found.overlap_share))
        missed = missed * (1.0 - found.chance)
    total = promise(1.0 - missed, targets)
    share = total.gain_share / plan.total.gain_share  # plan_of returns no plan without gain
    at_least = min(1.0, plan.at_least_of_best * share)
    return replace(plan, cameras=tuple(cameras), total=total, at_least_of_best=at_least)


def _cameras(seen: SeenPlace, judged: Candidates, choice: Choice) -> list[PlannedCamera]:
    return [
        PlannedCamera(
            judged.candidates[row].T_world_camera,
            judged.candidates[row].where,
            promise(gain, seen.targets),
            float(judged.overlap_shares[row]),
        )
        for row, gain in zip(choice.rows, choice.gains, strict=True)
    ]
