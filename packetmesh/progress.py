"""What a long computation says about itself while it runs, and how to run it to its end."""

from __future__ import annotations

from collections.abc import Callable, Generator
from dataclasses import dataclass, replace
from typing import Any, TypeVar

Result = TypeVar("Result")


@dataclass(frozen=True, slots=True)
class Progress:
    """One report of a running computation; generators yield it between units of work.

    Whoever consumes the generator decides what to do with it: draw a bar, log a line, or stop
    iterating, which cancels the computation.
    """

    stage: str
    """Name of the stage, in words a person reads (``"depth inference"``)."""
    fraction: float
    """Share of the whole computation that is done, 0 to 1."""


def drain(steps: Generator[Any, None, Result], on_step: Callable[[Any], None] = lambda step: None) -> Result:
    """Run a generator to its end and give what it returns; ``on_step`` gets everything that it yields."""
    while True:
        try:
            step = next(steps)
        except StopIteration as stop:
            return stop.value
        on_step(step)


def part(
    steps: Generator[Progress, None, Result], begin: float, end: float
) -> Generator[Progress, None, Result]:
    """The same computation as the part of a longer one that goes from ``begin`` to ``end`` of it."""
    while True:
        try:
            step = next(steps)
        except StopIteration as stop:
            return stop.value
        yield replace(step, fraction=begin + step.fraction * (end - begin))
