"""What a lesson's stop sets in the folder *Plan*, and the numbers that its text can name."""

from __future__ import annotations

import re
from collections.abc import Callable, Hashable, Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Any, Literal

import numpy as np

from app.lesson.files import NUMBER, Setting, choice
from app.screens.network.place import text_of
from app.screens.network.planning.controls import MOST_CAMERAS
from app.screens.network.planning.labels import SENSORS, WHERES
from app.screens.network.planning.numbers import points, seconds_text
from app.screens.network.planning.view import Arrival, GhostsView, PlanView, Poses, PromiseView, TakenView
from app.window.tables import UNKNOWN, number
from packetmesh.errors import InputError
from pipeline.kernels.geometry import rigid
from pipeline.types import FloatArray

MOST_CM = 200.0
PLANNED = (
    *("unmeasured", "candidates", "at_least", "least_overlap", "walls"),
    *("promise", "overlap", "seconds_99", "image_energy"),
)
"""Fields of the plan, and in the second line of its chosen ghost."""
JUDGED: Mapping[str, str] = MappingProxyType(
    {
        "judged_rooms": "20",
        "judged_cameras": "200",
        "judged_rank": "0.70",
        "judged_goal": "0.85",
        "judged_held": "92 %",
    }
)
"""How promises were judged: test rooms, cameras taken there, rank correlation of promised and real gain, its
goal, and real gains inside the 95 % interval (SPEC 12, docs/results/planning.json)."""
NUMBERS = (*PLANNED, "own", "own_overlap", "promised", "real", *JUDGED)
"""Fields of a plan, of the ghost that the user placed, of the camera that was added, and of test rooms."""


@dataclass(frozen=True, slots=True)
class PlanLook:
    """State of the folder *Plan* at a stop."""

    show: Literal["", "none", "missed", "beside", "suggest"] = ""
    """Nothing is changed; no plan; the unmeasured places alone; a ghost next to a camera; the suggestion."""
    beside: str = ""
    """Name of the present camera next to which the ghost is."""
    away_m: float = 0.0
    """Distance of the ghost to the camera's right."""
    cameras: int = 1
    sensor: str = "as-present"
    where: tuple[str, ...] = tuple(WHERES)

    @property
    def place(self) -> str:
        """The controls' values as text of the address."""
        shown = {kind: str(kind in self.where).lower() for kind in WHERES}
        return text_of({"cameras": str(self.cameras), **shown, "sensor": self.sensor}, {})


def _show(look: PlanLook, text: str) -> PlanLook:
    if text in ("none", "missed", "suggest"):
        return replace(look, show=text)  # type: ignore[arg-type]
    found = re.fullmatch(rf"beside (\S+) {NUMBER} ?cm", text)
    if found is None or float(found[2]) > MOST_CM:
        raise ValueError(
            f"try none, missed, suggest, or for example 'beside node_00 30 cm' with at most {MOST_CM:g} cm"
        )
    return replace(look, show="beside", beside=found[1], away_m=float(found[2]) / 100.0)


def _cameras(look: PlanLook, text: str) -> PlanLook:
    if not text.isdecimal() or not 1 <= int(text) <= MOST_CAMERAS:
        raise ValueError(f"try a whole number of cameras from 1 to {MOST_CAMERAS}")
    return replace(look, cameras=int(text))


def _where(look: PlanLook, text: str) -> PlanLook:
    kinds = tuple(one.strip() for one in text.split(","))
    if not set(kinds) <= WHERES.keys():
        raise ValueError(f"try one or more of {', '.join(WHERES)}, with commas")
    return replace(look, where=kinds)


def _of_plan(read: Callable[[PlanLook, str], PlanLook]) -> Setting[Any]:
    return lambda look, text: replace(look, plan=read(look.plan, text))


def _sensor(look: PlanLook, text: str) -> PlanLook:
    return replace(look, sensor=choice({name: name for name in SENSORS})(text))


SETTINGS: Mapping[str, Setting[Any]] = {
    "plan": _of_plan(_show),
    "new-cameras": _of_plan(_cameras),
    "sensor": _of_plan(_sensor),
    "where": _of_plan(_where),
}
"""The settings of a stop that are of the plan, by their names in the file; they change ``look.plan``."""


def beside(plan: PlanView, look: PlanLook) -> FloatArray:
    """Return the (4, 4) pose of a ghost that looks as a present camera does, to the right of it.

    Raises:
        InputError: there is no such camera.
    """
    if look.beside not in plan.present:
        raise InputError(
            f"The lesson puts a ghost beside {look.beside}, but the registered cameras here are "
            f"{', '.join(plan.present)}; write one of these"
        )
    T = np.reshape(plan.present[look.beside], (4, 4))
    return rigid(T[:3, :3], T[:3, 3] + look.away_m * T[:3, 0])


@dataclass(frozen=True, slots=True)
class PlanState:
    """The plan and the results that the numbers of a lesson describe."""

    plan: PlanView | None
    """The plan of the surface that is shown, whether or not its ghosts are; None if there is none."""
    pending: bool
    """Whether a plan, or the promise of its ghosts where they were moved to, is being computed."""
    ghosts: GhostsView | None
    """None while there are no ghosts, or they are being judged."""
    row: int
    """Index of the chosen ghost."""
    arrivals: tuple[Arrival, ...]
    """Empty while they are computed."""
    own: tuple[PromiseView, float] | None
    """Promise and overlap of the ghost that the user placed last; None if none was moved."""
    taken: TakenView | None
    """The camera that was added last."""


@dataclass(frozen=True, slots=True)
class Before:
    """The user's own plan, which a lesson has replaced."""

    controls: str
    plan: PlanView | None
    poses: Poses
    surface: Hashable
    """Key of the surface of the plan."""


def plan_numbers(state: PlanState) -> dict[str, str]:
    """Return the fields' values; those that are being computed are missing."""
    values = {**dict.fromkeys(NUMBERS, UNKNOWN), **JUDGED}
    plan, waiting = state.plan, state.pending
    if state.own is not None:
        values |= {"own": points(state.own[0]), "own_overlap": _percent(state.own[1])}
    if state.taken is not None:
        values["promised"] = points(state.taken.promise)
        values["real"] = number(state.taken.real_share, 1, "", 100.0)
    if plan is not None:
        values["unmeasured"] = number(1.0 - plan.measured_share, 1, "%", 100.0)
        values |= {"candidates": str(plan.candidates), "walls": str(plan.walls)}
        values["at_least"] = _percent(plan.at_least_of_best)
        values["least_overlap"] = _percent(plan.least_overlap)
    if state.ghosts is not None:
        ghost = state.ghosts.ghosts[state.row]
        values |= {"promise": points(ghost.promise), "overlap": _percent(ghost.overlap_share)}
        waiting |= not state.arrivals
    if state.ghosts is not None and state.arrivals:
        arrival = state.arrivals[state.row]
        values["seconds_99"] = seconds_text(arrival.seconds_to_99_s)
        values["image_energy"] = number(arrival.joules, 2, "J")
    coming = [name for name in PLANNED if waiting and values[name] == UNKNOWN]
    return {name: text for name, text in values.items() if name not in coming}


def _percent(share: float) -> str:
    return number(share, 0, "%", 100.0)
