"""Checks of config values: each raises an ``InputError`` of one sentence for an invalid value."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sized

from packetmesh.errors import InputError


def at_least(key: str, value: float | None, least: float) -> None:
    """Raise unless the value is None, or a finite number of at least ``least``."""
    if value is not None and not least <= value < math.inf:
        raise InputError(f"{key} is {value}; try at least {least}")


def above(key: str, value: float | None, bound: float) -> None:
    """Raise unless the value is None, or a finite number above ``bound``."""
    if value is not None and not bound < value < math.inf:
        raise InputError(f"{key} is {value}; try a value above {bound}")


def share(key: str, value: float, least: float = 0.0) -> None:
    """Raise unless ``least`` <= value <= 1."""
    if not least <= value <= 1.0:
        raise InputError(f"{key} is {value}; try a share between {least} and 1")


def one_of(key: str, value: float, choices: Iterable[float]) -> None:
    """Raise unless the value is one of the choices."""
    if value not in choices:
        raise InputError(f"{key} is {value:g}; try one of {', '.join(f'{one:g}' for one in choices)}")


def one_each(key: str, values: Sized, expected: int, what: str) -> None:
    """Raise unless there are no values or ``expected`` of them; ``what`` explains these in the message."""
    if len(values) not in (0, expected):
        raise InputError(f"{key} has {len(values)} numbers; try {expected}: {what}")


def several(key: str, values: Sized, each: int, what: str) -> None:
    """Raise unless the number of values is a multiple of ``each``, the numbers needed per ``what``."""
    if len(values) % each:
        raise InputError(f"{key} has {len(values)} numbers; try {each} for each {what}")


def finite(key: str, values: Iterable[float], unit: str) -> None:
    """Raise unless all values are finite; ``unit`` is the message's advice."""
    if not all(map(math.isfinite, values)):
        raise InputError(f"{key} holds {values}; try {unit}")
