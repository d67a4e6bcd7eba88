"""Checks of a config's values: each refuses what cannot be in one sentence."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sized

from packetmesh.errors import InputError


def at_least(key: str, value: float | None, least: float) -> None:
    """Refuses a value below ``least``, and what is no number."""
    if value is not None and not least <= value < math.inf:
        raise InputError(f"{key} is {value}; try at least {least}")


def above(key: str, value: float | None, bound: float) -> None:
    """Refuses a value that is not above ``bound``, and what is no number."""
    if value is not None and not bound < value < math.inf:
        raise InputError(f"{key} is {value}; try a value above {bound}")


def share(key: str, value: float, least: float = 0.0) -> None:
    """Refuses what is no share."""
    if not least <= value <= 1.0:
        raise InputError(f"{key} is {value}; try a share between {least} and 1")


def one_of(key: str, value: float, choices: Iterable[float]) -> None:
    """Refuses what is not among the choices."""
    if value not in choices:
        raise InputError(f"{key} is {value:g}; try one of {', '.join(f'{one:g}' for one in choices)}")


def one_each(key: str, values: Sized, wanted: int, what: str) -> None:
    """Refuses values that are neither none nor as many as wanted; ``what`` says which these are."""
    if len(values) not in (0, wanted):
        raise InputError(f"{key} has {len(values)} numbers; try {wanted}: {what}")


def several(key: str, values: Sized, each: int, what: str) -> None:
    """Refuses values that are not so many for each of some things; ``what`` says which these are."""
    if len(values) % each:
        raise InputError(f"{key} has {len(values)} numbers; try {each} for each {what}")


def finite(key: str, values: Iterable[float], unit: str) -> None:
    """Refuses values of which one is no number."""
    if not all(map(math.isfinite, values)):
        raise InputError(f"{key} holds {values}; try {unit}")
