"""Rewriting of arguments that the parser would misunderstand.

If an option with several values is given more than once, such as ``--set a=1 --set b=2``, the parser would
keep only the values of the last. It would take a place such as ``-0.2,1,1.5`` for an option.
"""

from __future__ import annotations

import re
from collections.abc import Sequence

REPEATABLE = ("--set", "--down", "--only", "--without")


_NEGATIVE_PLACE = re.compile(r"-[\d.][^\s,]*,")
"""Beginning of coordinates of which the first is negative."""


def with_negative_places(argv: Sequence[str]) -> list[str]:
    """Return the arguments with a blank before coordinates that begin with a minus sign."""
    return [f" {argument}" if _NEGATIVE_PLACE.match(argument) else argument for argument in argv]


def joined(argv: Sequence[str]) -> list[str]:
    """Return the arguments with each repeated option once, at the end, followed by all its values."""
    arguments = list(argv)
    for option in REPEATABLE:
        if sum(_is(option, argument) for argument in arguments) > 1:
            arguments = _joined(arguments, option)
    return arguments


def _joined(arguments: list[str], option: str) -> list[str]:
    others, values, within = list[str](), list[str](), False
    for argument in arguments:
        if _is(option, argument):
            within = True
            values += [argument.partition("=")[2]] if argument != option else []
        elif argument.startswith("--"):
            within = False
            others.append(argument)
        else:
            (values if within else others).append(argument)
    return [*others, option, *values]


def _is(option: str, argument: str) -> bool:
    return argument == option or argument.startswith(f"{option}=")
