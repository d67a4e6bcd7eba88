"""Messages of a page's dock: the actions of its user that the server has not acknowledged."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from typing import Any

LONGEST_PAGE = 40
"""Most letters of a page's name."""
BOUND = 2.0**53
"""Bound of the numbers in a message; whole numbers below it are exact on every page."""


def actions_in(text: str) -> tuple[str, list[tuple[int, str, list[Any]]]]:
    """Return the page's name, and its actions as number, name and arguments; none if it is no message."""
    try:
        message = json.loads(text)
        page, actions = str(message["page"])[:LONGEST_PAGE], list(message["actions"])
    except (ValueError, KeyError, TypeError, RecursionError):
        return "", []
    return page, list(_well_formed(actions))


def _well_formed(actions: Sequence[Any]) -> Iterator[tuple[int, str, list[Any]]]:
    for action in actions:
        match action:
            case [int(number), str(name), *arguments] if is_number(number):
                yield number, name, arguments


def is_number(value: object) -> bool:
    """Whether a value is a finite number that every page can read."""
    return isinstance(value, int | float) and not isinstance(value, bool) and abs(value) < BOUND
