"""A claim, the thesis's or ours, and the verdict on it."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterable
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from lab.claims.exhibits import Curve, Exhibit, exhibit_record
from packetmesh.progress import Progress
from pipeline.types import FloatArray

VERDICTS = (
    *("reproduced", "not reproduced", "true by definition", "cannot be tested"),
    *("holds", "does not hold"),
)
"""The last two are of claims of ours."""


@dataclass(frozen=True, slots=True)
class Outcome:
    """What our own computation of a claim gave."""

    ours: dict[str, float]
    """Measured values by name; shares from 0 to 1, lengths in metres."""
    ci95: dict[str, tuple[float, float]]
    """95 % intervals of those values that vary from case to case."""
    reproduced: bool | None
    """Of ours: whether it holds. None: nothing that we have can test it."""
    why: str
    """One sentence that a reader can check against ``ours``."""
    exhibits: tuple[Exhibit, ...] = ()
    """Tables and pictures for the report."""


@dataclass(frozen=True, slots=True)
class Verdict:
    """A claim beside its outcome."""

    id: str
    claim: str
    thesis: str
    tolerance: str
    ours: dict[str, float]
    ci95: dict[str, tuple[float, float]]
    verdict: str
    """One of ``VERDICTS``."""
    why: str
    exhibits: tuple[Exhibit, ...] = ()

    @property
    def beyond(self) -> bool:
        """Whether it is ours, and the thesis does not say it."""
        return is_beyond(self.id)

    def record(self) -> dict[str, Any]:
        """The verdict as plain values."""
        exhibits = [exhibit_record(exhibit) for exhibit in self.exhibits]
        return asdict(replace(self, exhibits=())) | {"exhibits": exhibits}


@dataclass(frozen=True, slots=True)
class Claim:
    """Something that can be computed."""

    id: str
    """Its number in SPEC 8: C and two digits for what the thesis says, D for ours beyond it."""
    claim: str
    thesis: str
    """The thesis's own value, or that it has none."""
    tolerance: str
    """What counts as reproduced."""
    experiment: Callable[..., Outcome]
    """Called with what ``prepare`` returned, if there is one, else with nothing."""
    prepare: Callable[[Path, str | None], Generator[Progress, None, Any]] | None = None
    """Its trials, by the folder that keeps them and the address of a Dask scheduler; claims with the same
    function share one call of it."""
    prepare_full: Callable[[Path, str | None], Generator[Progress, None, Any]] | None = None
    """Where ``prepare`` runs a subset of the trials: all of them."""
    by_definition: bool = False
    """Whether a check of it cannot tell anything of the world: settings, file formats, sums of what is
    printed. It is no finding if it comes out, but one if it does not."""

    def judge(self, *prepared: Any) -> Verdict:
        """Run the experiment and compare."""
        outcome = self.experiment(*prepared)
        return Verdict(
            self.id,
            self.claim,
            self.thesis,
            self.tolerance,
            outcome.ours,
            outcome.ci95,
            self._word(outcome.reproduced),
            outcome.why,
            outcome.exhibits,
        )

    def _word(self, reproduced: bool | None) -> str:
        if reproduced is None:
            return "cannot be tested"
        if is_beyond(self.id):
            return "holds" if reproduced else "does not hold"
        if not reproduced:
            return "not reproduced"
        return "true by definition" if self.by_definition else "reproduced"


def is_beyond(name: str) -> bool:
    """Whether a claim of that name is ours, and the thesis does not say it."""
    return name.startswith("D")


def bootstrap_ci95(
    values: FloatArray, seed: int = 0, resamples: int = 2000, statistic: Callable[..., Any] = np.mean
) -> tuple[float, float]:
    """95 % percentile interval of the mean, or of another statistic, of (N, ...) ``values``, N cases."""
    values = np.asarray(values, float)
    rows = np.random.default_rng(seed).integers(0, len(values), (resamples, len(values)))
    low, high = np.percentile(statistic(values[rows], axis=1), (2.5, 97.5))
    return float(low), float(high)


def mean_curve(label: str, x: Iterable[float], columns: Iterable[FloatArray], resamples: int = 2000) -> Curve:
    """The means of (N,) values at each ``x``, with their bootstrap intervals as a band."""
    points = [(float(column.mean()), *bootstrap_ci95(column, resamples=resamples)) for column in columns]
    means, low, high = zip(*points, strict=True)
    return Curve(label, tuple(float(value) for value in x), means, low, high)
