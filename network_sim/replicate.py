"""Replicated runs with independent seeds, 95 % confidence intervals, and parameter sweeps (SPEC 6.2)."""

from __future__ import annotations

import math
from collections.abc import Generator, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import stdtrit  # student's t; scipy.stats takes a second to import

from network_sim.config import NetworkConfig
from network_sim.metrics.metrics import Metric, metrics
from network_sim.simulate import simulate
from packetmesh.batch import run_batch
from packetmesh.errors import InputError
from packetmesh.progress import Progress
from packetmesh.settings import with_settings


@dataclass(frozen=True, slots=True)
class Estimate:
    """Mean and confidence interval of a metric over independent runs."""

    mean: float
    ci95: float | None
    """Half-width of the 95 % confidence interval (Student's t); None for a single run."""
    unit: str
    definition: str
    values: tuple[float, ...]
    """The metric's value in each run that has it, in the order of the seeds."""


Estimates = Mapping[str, Estimate]


def measured(config: NetworkConfig) -> dict[str, Metric]:
    """Simulate one run and return its metrics."""
    return metrics(simulate(config))


def replications(config: NetworkConfig, count: int) -> list[NetworkConfig]:
    """Return ``count`` copies of ``config`` with the seeds ``run.seed``, ``run.seed + 1``, ...

    Raises:
        InputError: ``count`` is below 1.
    """
    if count < 1:
        raise InputError(f"replications is {count}; try at least 1")
    return [replace(config, run=replace(config.run, seed=config.run.seed + run)) for run in range(count)]


def iterate_runs(
    configs: Sequence[NetworkConfig], scheduler: str | None = None
) -> Generator[Progress, None, list[dict[str, Metric]]]:
    """Simulate all configs in parallel; returns the metrics of each, in the order of the configs.

    ``scheduler`` is the address of a Dask scheduler; None uses this machine's cores.
    """
    answers: dict[int, dict[str, Metric]] = {}
    for index, answer in run_batch(measured, configs, scheduler):
        answers[index] = answer
        yield Progress(f"run {len(answers)} of {len(configs)}", len(answers) / len(configs))
    return [answers[index] for index in range(len(configs))]


def iterate_sweep(
    config: NetworkConfig, key: str, values: Sequence[str], count: int, scheduler: str | None = None
) -> Generator[Progress, None, dict[str, Estimates]]:
    """Estimate the metrics for each value of a setting such as ``"scheme.k"``; returns them by value.

    Each value has ``count`` runs, with the same seeds for all values; ``scheduler`` as in ``iterate_runs``.
    """
    cases = [with_settings(config, [f"{key}={value}"]) for value in values]
    runs = yield from iterate_runs([run for case in cases for run in replications(case, count)], scheduler)
    return {value: estimates_of(runs[i * count : (i + 1) * count]) for i, value in enumerate(values)}


def estimates_of(runs: Sequence[Mapping[str, Metric]]) -> dict[str, Estimate]:
    """Estimate each metric over the runs that have it (the image delay needs an image that arrived)."""
    names = dict.fromkeys(name for run in runs for name in run)
    estimates = {}
    for name in names:
        found = [run[name] for run in runs if name in run]
        values = tuple(float(metric.value) for metric in found)
        mean, half = t_interval(values)
        estimates[name] = Estimate(mean, half, found[0].unit, found[0].definition, values)
    return estimates


def t_interval(values: Iterable[float], confidence: float = 0.95) -> tuple[float, float | None]:
    """Return the mean and the half-width of its Student's t interval (None for a single value)."""
    numbers = np.fromiter(values, float)
    if len(numbers) < 2:
        return float(numbers.mean()), None
    quantile = float(stdtrit(len(numbers) - 1, 0.5 + 0.5 * confidence))
    return float(numbers.mean()), quantile * float(numbers.std(ddof=1)) / math.sqrt(len(numbers))
