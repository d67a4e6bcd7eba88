"""Options with several values that are given more than once, such as ``--set a=1 --set b=2``.

The parser would keep the last one's values only.
"""

from __future__ import annotations

from collections.abc import Sequence

REPEATABLE = ("--set", "--down", "--only", "--without")


def joined(argv: Sequence[str]) -> list[str]:
    """Return the arguments with all values of a repeated option after its last occurrence."""
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
