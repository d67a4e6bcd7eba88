"""Speed and memory beside peers, in one run; each case in a fresh process, so that its memory is its own."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import partial
from importlib import import_module
from typing import Any

from lab.benchmarks.benchmark import Benchmark, run_alone
from packetmesh.errors import InputError


def _measure(module: str, **options: Any) -> Benchmark:
    """``benchmark`` of a module of this package, imported here: what other cases import would count."""
    result: Benchmark = import_module(f"lab.benchmarks.{module}").benchmark(**options)
    return result


CASES: dict[str, Callable[[], Benchmark]] = {
    "reconstruct one 640x480 pair": partial(_measure, "chain", nodes=1),
    "reconstruct a rig of three": partial(_measure, "chain", nodes=3),
    "registration": partial(_measure, "registration", peers_thinned=False),
    "registration, peers thinned like ours": partial(_measure, "registration", peers_thinned=True),
    "surface": partial(_measure, "surface"),
    "depth": partial(_measure, "depth"),
    "network": partial(_measure, "network"),
}


def run_benchmarks(
    only: Iterable[str] = (), cases: Mapping[str, Callable[[], Benchmark]] = CASES
) -> Iterator[tuple[str, Benchmark]]:
    """Measure the cases named, or all, one after the other.

    Raises:
        InputError: a name is not a case.
    """
    wanted = list(only) or list(cases)
    unknown = [name for name in wanted if name not in cases]
    if unknown:
        raise InputError(f"There is no benchmark '{unknown[0]}'; known are {', '.join(cases)}")
    for name in wanted:
        yield name, run_alone(cases[name])
