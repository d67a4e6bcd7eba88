"""Benchmark cases: speed and memory of PacketMesh and of other programs, each case in a fresh process."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import partial
from importlib import import_module
from typing import Any

from lab.benchmarks.benchmark import Benchmark, run_alone
from packetmesh.errors import InputError


def _measure(module: str, function: str = "benchmark", **options: Any) -> Benchmark:
    """Import a module of this package and call its function; the modules of other cases are not imported."""
    result: Benchmark = getattr(import_module(f"lab.benchmarks.{module}"), function)(**options)
    return result


CASES: dict[str, Callable[[], Benchmark]] = {
    "chain: one 640x480 pair": partial(_measure, "chain", nodes=1),
    "chain: a rig of three": partial(_measure, "chain", nodes=3),
    "registration: all of 100,000 points": partial(_measure, "registration", points=100_000, drawn="none"),
    "registration: all of 10,000 points": partial(_measure, "registration", points=10_000, drawn="none"),
    "registration: ours draws 10,000 of 100,000": partial(
        _measure, "registration", points=100_000, drawn="ours"
    ),
    "registration: all programs draw them": partial(_measure, "registration", points=100_000, drawn="both"),
    "places: by overlap": partial(_measure, "places"),
    "places: any overlap": partial(_measure, "places", "verdicts"),
    "places: lists of bare clouds": partial(_measure, "place_lists"),
    "recording: every frame": partial(_measure, "recording"),
    "recording: every fifth frame": partial(_measure, "recording", every=5),
    "surface": partial(_measure, "surface"),
    "measuring": partial(_measure, "measuring"),
    "depth": partial(_measure, "depth"),
    "codings": partial(_measure, "codings"),
    "network": partial(_measure, "network"),
}
"""Cases by name; the part of the name before a colon is the name of a group of cases."""


def run_benchmarks(
    only: Iterable[str] = (), cases: Mapping[str, Callable[[], Benchmark]] = CASES
) -> Iterator[tuple[str, Benchmark]]:
    """Measure cases one after the other; yield the name and the result of each.

    Args:
        only: names of cases or groups; none measures all.
        cases: all cases by name.

    Raises:
        InputError: a name is neither a case nor a group.
    """
    requested = set(only)
    named = {case: {case, case.partition(":")[0]} for case in cases}
    known = {name: None for names in named.values() for name in sorted(names)}
    for name in sorted(requested - set(known)):
        raise InputError(f"There is no benchmark '{name}'; known are {', '.join(known)}")
    for case, names in named.items():
        if not requested or names & requested:
            yield case, run_alone(cases[case])
