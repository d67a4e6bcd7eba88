"""The study of Table 4.7 and Figure 4.10: schemes, numbers of vehicles and k (SPEC 6.2).

Each case has five runs of five hours, without the first half hour. All cases use the same seeds.
"""

from __future__ import annotations

from collections.abc import Generator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from lab.claims.network.intervals import interval
from lab.claims.network.tasks import Values, street_values
from lab.trials import iterate_trials
from network_sim.config import NetworkConfig
from network_sim.presets import PRESETS
from network_sim.replicate import replications
from network_sim.settings.street import SchemeName
from packetmesh.progress import Progress

STREET = PRESETS["street-grid"]
SCHEMES: tuple[SchemeName, ...] = ("baseline", "greedy", "pdc")
OBJECTS = (10, 20, 40, 80, 120)
CAPS = (3, 5, 10, 20, None)
"""Values of k; None is unlimited."""
CAPPED_OBJECTS = 40
RUNS = 5


@dataclass(frozen=True, slots=True)
class Case:
    """One point of a curve."""

    scheme: SchemeName
    objects: int
    """Number of vehicles."""
    k: int | None = None
    """Most ids in a request of greedy; None is unlimited."""
    image_bytes: int = STREET.scheme.image_bytes

    def config(self, horizon_s: float = STREET.run.horizon_s) -> NetworkConfig:
        """Return the config of its first run; the others differ in the seed."""
        scheme = replace(STREET.scheme, name=self.scheme, k=self.k, image_bytes=self.image_bytes)
        street = replace(STREET.street, vehicles=self.objects)
        return replace(STREET, scheme=scheme, street=street, run=replace(STREET.run, horizon_s=horizon_s))


Found = dict[Case, list[Values]]
"""The metrics of every run, by case and in the order of the seeds."""


def standard_cases() -> tuple[Case, ...]:
    """Return every scheme with every number of vehicles, and greedy with every k."""
    grid = [Case(scheme, objects) for objects in OBJECTS for scheme in SCHEMES]
    return tuple(dict.fromkeys([*grid, *(Case("greedy", CAPPED_OBJECTS, k) for k in CAPS)]))


def street_study(folder: Path, scheduler: str | None) -> Generator[Progress, None, Found]:
    """Run the whole study."""
    return (yield from run_cases("C33 to C35, street grid", standard_cases(), folder, scheduler))


def run_cases(
    stage: str,
    cases: Sequence[Case],
    folder: Path,
    scheduler: str | None = None,
    horizon_s: float = STREET.run.horizon_s,
    runs: int = RUNS,
) -> Generator[Progress, None, Found]:
    """Run every case; the long runs start first, so that all cores finish at about the same time."""
    order = sorted(cases, key=lambda case: case.objects * case.image_bytes, reverse=True)
    tasks = [run for case in order for run in replications(case.config(horizon_s), runs)]
    found = yield from iterate_trials(stage, street_values, tasks, folder, scheduler)
    return {
        case: found[first : first + runs]
        for case, first in zip(order, range(0, len(found), runs), strict=True)
    }


def values(found: Found, case: Case, metric: str) -> list[float]:
    """Return the values of a metric in those runs of a case that have it."""
    return [float(value) for run in found[case] if (value := run[metric]) is not None]


def mean(found: Found, case: Case, metric: str) -> float:
    """Return the metric's mean over the runs."""
    return interval(values(found, case, metric))[0]
