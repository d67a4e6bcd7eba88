"""Progress reports of a long computation, and running a generator of steps to its end."""

from __future__ import annotations

from collections.abc import Callable, Generator
from dataclasses import dataclass
from typing import TypeVar

Step = TypeVar("Step")
Result = TypeVar("Result")
REPORTS = 100
"""Approximate number of progress reports of a long loop."""


@dataclass(frozen=True, slots=True)
class Progress:
    """One progress report, yielded by the computation's generator between units of work.

    The consumer draws a bar, logs a line, or closes the generator, which cancels the computation.
    """

    stage: str
    """Name of the stage, readable for users (``"depth inference"``)."""
    fraction: float
    """Share of the whole computation that is done, 0 to 1."""


def spaced(count: int, least: int) -> int:
    """Return after how many of ``count`` steps to report progress: ``least`` or more, below 200 reports."""
    return max(least, count // REPORTS)


def drain(
    steps: Generator[Step, None, Result], on_step: Callable[[Step], object] = lambda step: None
) -> Result:
    """Run a generator to its end and return its result.

    Args:
        steps: generator of any ``iterate_...`` function.
        on_step: called with each step it yields.

    Returns:
        The generator's return value.

    >>> import packetmesh as pm
    >>> config = pm.with_settings(pm.NETWORK_PRESETS["thesis-link"], ["nodes.image_bytes=2000"])
    >>> reports = []
    >>> pm.drain(pm.iterate_simulation(config), reports.append).names
    ('node 1', 'node 2', 'node 3', 'sink')
    >>> reports[-1].fraction
    1.0
    """
    while True:
        try:
            step = next(steps)
        except StopIteration as stop:
            return stop.value
        on_step(step)


def part(
    steps: Generator[Progress, None, Result], stage: str, begin: float, end: float, detail: bool = False
) -> Generator[Progress, None, Result]:
    """Run a computation as a stage of a longer one and rescale its progress from 0..1 to ``begin``..``end``.
    With ``detail``, reports append the computation's own stage name to ``stage``.
    """
    while True:
        try:
            step = next(steps)
        except StopIteration as stop:
            return stop.value
        name = f"{stage}: {step.stage}" if detail else stage
        yield Progress(name, begin + step.fraction * (end - begin))
