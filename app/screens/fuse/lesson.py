"""The lesson of the race: the settings of its stops, the numbers of its texts, and its file."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from app.lesson.files import LESSONS, NUMBER, SCENE, Kind, Numbers, Setting, choice, quantity, sets, short
from app.screens.fuse.labels import DIRECTIONS, MODES, MOST_LANES, RIVAL_NAMES, RIVALS, STARTS
from app.screens.fuse.numbers import off_text
from app.screens.fuse.place import MOST_AWAY
from app.screens.fuse.view import Race, RaceView, Rival, Start
from app.window.tables import UNKNOWN, number

SHIPPED = LESSONS / "icp-against-ceicp.md"
START = (3.0, 6.0)
"""Start error of a section that sets none: degrees, centimetres."""


@dataclass(frozen=True, slots=True)
class RaceLook:
    """The race that a stop shows, and the state of its player and charts."""

    race: Race = field(default_factory=lambda: Race(start=Start.towards(*START, seed=0)))
    """The race; its nodes are not used, because those that the user has chosen stay."""
    in_ms: bool = False
    """Whether the curves run over time instead of iterations."""
    place: int | None = 0
    """Iteration, or milliseconds, to show; None is the end."""
    lane: int = 0
    """Index of the lane whose pairs the histogram shows."""


def _races(key: str, read: Callable[[str], Any]) -> Setting[RaceLook]:
    """Return a setting that stores what ``read`` makes of the text in one field of the race."""

    def put(look: RaceLook, text: str) -> RaceLook:
        race = replace(look.race, **{key: read(text)})
        if race.degrades_room:
            raise ValueError("a synthetic room cannot be degraded; try another mode, or no degradation")
        return replace(look, race=race)

    return put


_VECTOR = " ".join([rf"(-?{NUMBER[1:-1]})"] * 3)


def _methods(text: str) -> tuple[Rival, ...]:
    names = {name.lower().replace(",", ""): rival for name, rival in RIVALS.items()}
    rivals = tuple(choice(names)(part.strip().lower()) for part in text.split(","))
    if len(rivals) > MOST_LANES:
        raise ValueError(f"try at most {MOST_LANES} methods")
    return rivals


def _start(text: str) -> Start:
    names = {short(name): error for name, error in STARTS.items()}
    found = re.fullmatch(rf"{NUMBER} deg {NUMBER} cm", text)
    if found is not None:
        turn_deg, shift_cm = _within(found.groups())
        return Start.towards(turn_deg, shift_cm, seed=0)
    vectors = re.fullmatch(rf"turn {_VECTOR} deg shift {_VECTOR} cm", text)
    if vectors is not None:
        values = _within(vectors.groups())
        return Start((values[0], values[1], values[2]), (values[3], values[4], values[5]))
    if text not in names:
        raise ValueError(
            f"try one of {', '.join(names)} or for example '10 deg 20 cm' or 'turn 0 90 0 deg shift 5 0 0 cm'"
        )
    return Start.towards(*names[text], seed=0)


def _within(numbers: Sequence[str]) -> list[float]:
    """Return the degrees and centimetres of a start."""
    values = [float(number) for number in numbers]
    if max(map(abs, values)) > MOST_AWAY:
        raise ValueError(f"try at most {MOST_AWAY:g} deg and {MOST_AWAY:g} cm")
    return values


def _place(text: str) -> int | None:
    if text in ("start", "end"):
        return 0 if text == "start" else None
    if re.fullmatch(r"\d{1,9}", text) is None:
        raise ValueError("try start, end or the number of an iteration")
    return int(text)


SETTINGS: dict[str, Setting[RaceLook]] = {
    "mode": _races("mode", choice(MODES)),
    "methods": _races("rivals", _methods),
    "pairs": _races("direction", choice(DIRECTIONS)),
    "start": _races("start", _start),
    "noise": _races("noise_m", quantity("cm", 10.0, 100.0)),
    "outliers": _races("outlier_share", quantity("%", 60.0, 100.0)),
    "holes": _races("hole_share", quantity("%", 80.0, 100.0)),
    "cut off": _races("crop_share", quantity("%", 80.0, 100.0)),
    "depth bias": _races("depth_bias", quantity("%", 15.0, 100.0)),
    "axis": sets("in_ms", choice({"iterations": False, "milliseconds": True})),
    "position": sets("place", _place),
    "lane": sets("lane", choice({str(index + 1): index for index in range(MOST_LANES)})),
}
"""The settings of a stop, by their names in the file."""


PER_LANE = ("name", "end", "iterations", "time", "rmse", "verdict")
NUMBERS = (
    *(f"{name}_{lane}" for name in PER_LANE for lane in range(1, MOST_LANES + 1)),
    *("begin", "turn", "shift", "holes", "bias", "noise", "more", "others"),
)
"""Fields of the texts and choices; a lane's fields end with its number."""
ALIKE_M = 0.005
"""Final errors that differ by no more than this count as equal."""


WORDS = {"more": ("weights", "alike", "plane"), "others": ("far", "close", "nearer")}
"""Words that decide a question by two errors: for the first being less, for both alike, for the second."""


def numbers(scene: str, race: Race, view: RaceView) -> Numbers:
    """Return the values of the lesson's fields for a race; errors are the ``off_m`` of its steps."""
    values = dict.fromkeys(NUMBERS, UNKNOWN)
    for place, lane in enumerate(view.lanes, 1):
        values[f"name_{place}"] = RIVAL_NAMES[lane.rival].replace(",", "")
        values[f"end_{place}"] = off_text(lane.steps[-1])
        values[f"iterations_{place}"] = str(lane.iterations)
        values[f"time_{place}"] = number(lane.elapsed_s, 0, "ms", 1000.0)
        values[f"rmse_{place}"] = number(lane.steps[-1].rmse_m, 1, "cm", 100.0)
        values[f"verdict_{place}"] = lane.verdict_text
    values |= {
        "begin": off_text(view.lanes[0].steps[0], digits=1),
        "turn": f"{np.linalg.norm(race.start.turn_deg):.0f}°",
        "shift": number(float(np.linalg.norm(race.start.shift_cm)), 0, "cm"),
        "holes": number(race.hole_share, 0, "%", 100.0),
        "bias": number(race.depth_bias, 0, "%", 100.0),
        "noise": number(race.noise_m, 0, "cm", 100.0),
    }
    ends = ((lane.rival, lane.steps[-1]) for lane in view.lanes)
    ends_m = {rival: np.inf if step.out_of_reach else step.off_m for rival, step in ends}
    return {SCENE: scene, **values, **_verdicts(ends_m)}


def _verdicts(ends_m: Mapping[Rival, float]) -> dict[str, str]:
    """Return the word of each question whose two errors are known: CEICP-A's weights or the plane metric;
    CEICP or the trimmed methods without entropy. An error is infinite if it is out of reach."""
    words = {}
    plane_m, weights_m = ends_m.get(("icp", "plane")), ends_m.get(("ceicp-a", "point"))
    if plane_m is not None and weights_m is not None:
        words["more"] = _which(weights_m, plane_m, WORDS["more"])
    own_m, others_m = (
        min((end_m for (method, _), end_m in ends_m.items() if method in methods), default=None)
        for methods in (("ceicp-n", "ceicp-a"), ("trimmed-icp", "ficp"))
    )
    if own_m is not None and others_m is not None:
        words["others"] = _which(own_m, others_m, WORDS["others"])
    return words


def _which(one_m: float, other_m: float, words: tuple[str, str, str]) -> str:
    """Return the first word if ``one_m`` is less by more than ``ALIKE_M``, the last if ``other_m`` is;
    ``UNKNOWN`` if both are out of reach."""
    if one_m == other_m == np.inf:
        return UNKNOWN
    if abs(one_m - other_m) <= ALIKE_M:
        return words[1]
    return words[0] if one_m < other_m else words[2]


def statement(values: Mapping[str, str]) -> str:
    """Return where the lanes end, for screen readers."""
    lanes = [lane for lane in range(1, MOST_LANES + 1) if values[f"name_{lane}"] != UNKNOWN]
    verdicts = (re.split(r"[:;,]", values[f"verdict_{lane}"])[0] for lane in lanes)
    ends = (
        f"{values[f'name_{lane}']} ends {values[f'end_{lane}']} off ({verdict})"
        for lane, verdict in zip(lanes, verdicts, strict=True)
    )
    return f"{values[SCENE]}, from {values['begin']} off: {', '.join(ends)}."


KIND = Kind("fuse", SETTINGS, RaceLook(), NUMBERS, statement, WORDS)
