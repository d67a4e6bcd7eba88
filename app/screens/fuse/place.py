"""A race in the address: the settings that differ from the first race, separated by spaces."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import replace

from app.lesson.files import choice
from app.screens.fuse.labels import DEGRADATIONS, MOST_LANES, MOST_SEED, MS, RIVALS, SLIGHTLY, STARTS
from app.screens.fuse.player import END
from app.screens.fuse.view import Race, Rival, Start
from packetmesh.errors import InputError
from packetmesh.settings import settings, with_settings

FIRST = Race(start=Start.towards(*STARTS[SLIGHTLY], seed=0))
"""The race that is shown first."""
MOST_NODE, MOST_AWAY = 99, 1000.0
"""Largest node index, and largest degrees or centimetres along an axis, in an address."""
_RIVALS = "rivals"
_NAMES: Mapping[str, Rival] = {"-".join(rival): rival for rival in RIVALS.values()}


def race_text(race: Race) -> str:
    """Return the text of a race: ``seed=3 rivals=icp-point,ceicp-a-plane``; empty for the first race."""
    first = _settings(FIRST)
    return " ".join(f"{key}={value}" for key, value in _settings(race).items() if value != first[key])


def race_of(text: str) -> Race:
    """Return the race in a text.

    Raises:
        InputError: a setting is unknown, its value is invalid or outside the sliders' range, or a synthetic
            room is degraded.
    """
    changes = dict(change.partition("=")[::2] for change in text.split())
    rivals = changes.pop(_RIVALS, None)
    race = with_settings(FIRST, [f"{key}={value}" for key, value in changes.items()])
    if rivals is not None:
        try:
            race = replace(race, rivals=tuple(choice(_NAMES)(name) for name in rivals.split(",")))
        except ValueError as error:
            raise InputError(f"The address has the methods {rivals[:60]}; {error}") from None
    _check(race)
    return race


def moment_text(at: str, in_ms: bool) -> str:
    """Return ``12``, ``12ms`` or ``end``; empty at the start.

    Args:
        at: iteration, millisecond or ``END``; empty or 0 is the start.
        in_ms: whether the race is played in milliseconds.
    """
    return "" if at in ("", "0") else f"{at}{MS if in_ms else ''}"


def moment_of(text: str) -> tuple[float | None, bool]:
    """Return the moment in a text, None for the end, and whether it is in milliseconds.

    Raises:
        InputError: the text is no moment.
    """
    number = text.removesuffix(MS)
    if re.fullmatch(rf"\d{{1,9}}(\.\d{{1,9}})?|{END}|", number) is None:
        raise InputError(
            f"The address has t={text[:20]}; try an iteration such as 12, a time such as 12ms, or {END}"
        )
    return None if number == END else float(number or 0.0), text.endswith(MS)


def _settings(race: Race) -> dict[str, str]:
    return settings(race) | {_RIVALS: ",".join("-".join(rival) for rival in race.rivals)}


def _check(race: Race) -> None:
    vectors = (race.start.turn_deg, race.start.shift_cm)
    if race.degrades_room:
        raise InputError("The address degrades a synthetic room; try mode=nodes, or no degradation")
    worse = all(
        0.0 <= getattr(race, name) <= most / per for name, (_, most, _, per, _) in DEGRADATIONS.items()
    )
    if not (
        worse
        and 1 <= len(race.rivals) <= MOST_LANES
        and all(0 <= node <= MOST_NODE for node in (race.source, race.target))
        and 0 <= race.seed <= MOST_SEED
        and all(len(vector) == 3 and max(map(abs, vector)) <= MOST_AWAY for vector in vectors)
    ):
        raise InputError("The address has a race outside the Fuse screen's sliders; set the race there")
