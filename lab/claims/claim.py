"""A claim, of the thesis or ours, and its verdict."""

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
"""Verdicts; the last two are for our own claims."""


@dataclass(frozen=True, slots=True)
class Outcome:
    """The result of our computation of a claim."""

    ours: dict[str, float]
    """Measured values by name: shares from 0 to 1, lengths in metres, others in the unit of the name.
    F-scores, shares of rays and their changes are in points of 100 in D01, D04, D05, D07 and D08."""
    ci95: dict[str, tuple[float, float]]
    """95 % intervals of the values that vary between cases."""
    reproduced: bool | None
    """Whether the thesis's claim is reproduced, or ours holds; None if our data cannot test it."""
    why: str
    """One sentence that can be checked against ``ours``."""
    exhibits: tuple[Exhibit, ...] = ()
    """Tables and pictures for the report."""


@dataclass(frozen=True, slots=True)
class Verdict:
    """A claim with its outcome; fields as in ``Claim`` and ``Outcome``."""

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
        """Whether the claim is ours and not the thesis's."""
        return is_beyond(self.id)

    def record(self) -> dict[str, Any]:
        """Return the verdict as plain values."""
        exhibits = [exhibit_record(exhibit) for exhibit in self.exhibits]
        return asdict(replace(self, exhibits=())) | {"exhibits": exhibits}


@dataclass(frozen=True, slots=True)
class Claim:
    """A statement that can be tested by a computation."""

    id: str
    """Its number in SPEC 8: C and two digits for the thesis's claims, D for our own."""
    claim: str
    thesis: str
    """The thesis's own value, or a note that it has none."""
    tolerance: str
    """Condition for the verdict *reproduced*."""
    experiment: Callable[..., Outcome]
    """Called with the result of ``prepare``, if there is one, else without arguments."""
    prepare: Callable[[Path, str | None], Generator[Progress, None, Any]] | None = None
    """Runs the trials; takes their folder and a Dask scheduler's address. Claims with the same function share
    one call of it."""
    prepare_full: Callable[[Path, str | None], Generator[Progress, None, Any]] | None = None
    """Runs all trials, if ``prepare`` runs only a subset."""
    by_definition: bool = False
    """Whether the claim is true by definition: it states a setting, a file format or a sum of printed
    numbers. Only its failure is a finding."""

    def judge(self, *prepared: Any) -> Verdict:
        """Run the experiment and compare its result with the claim."""
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
    """Return whether the claim with the id ``name`` is ours and not the thesis's."""
    return name.startswith("D")


def bootstrap_ci95(
    values: FloatArray, seed: int = 0, resamples: int = 2000, statistic: Callable[..., Any] = np.mean
) -> tuple[float, float]:
    """Return the 95 % bootstrap percentile interval of a statistic of (N, ...) ``values`` over N cases.

    ``statistic`` is called with (resamples, N, ...) resampled values and ``axis=1``.
    """
    values = np.asarray(values, float)
    rows = np.random.default_rng(seed).integers(0, len(values), (resamples, len(values)))
    low, high = np.percentile(statistic(values[rows], axis=1), (2.5, 97.5))
    return float(low), float(high)


def mean_curve(label: str, x: Iterable[float], columns: Iterable[FloatArray], resamples: int = 2000) -> Curve:
    """Return a line through the means of the ``columns``, (N,) values at each ``x``; its band is their 95 %
    bootstrap intervals."""
    points = [(float(column.mean()), *bootstrap_ci95(column, resamples=resamples)) for column in columns]
    means, low, high = zip(*points, strict=True)
    return Curve(label, tuple(float(value) for value in x), means, low, high)
