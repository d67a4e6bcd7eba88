"""Exchange rates, and intervals over rigs and what was repeated with each of them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TypeVar

import numpy as np

from pipeline.types import FloatArray

Item = TypeVar("Item")
Groups = Sequence[Sequence[Item]]
"""One group a rig, of what was repeated with it."""
RESAMPLES = 2000


def slope(pairs: FloatArray) -> float:
    """What a unit of the first column costs of the second, (N, 2): least squares through the origin.

    Through the origin, as what nothing lost costs is known to be nothing.
    """
    lost, cost = np.asarray(pairs, float).reshape(-1, 2).T
    return float(lost @ cost / (lost @ lost)) if lost.any() else float("nan")


def mean_slope(groups: Groups[FloatArray]) -> float:
    """The mean over the rigs of the slope of all (N, 2) pairs of a rig."""
    return float(np.mean([slope(np.concatenate(list(group))) for group in groups]))


def grouped_mean(groups: Groups[float]) -> float:
    """The mean over the rigs of their means."""
    return float(np.mean([np.mean(list(group)) for group in groups]))


def resampled_ci95(
    groups: Groups[Item],
    statistic: Callable[[Groups[Item]], float],
    seed: int = 0,
    resamples: int = RESAMPLES,
) -> tuple[float, float]:
    """95 % percentile interval of a statistic over rigs and what was repeated with each of them.

    Repetitions share their rig, so that rigs are drawn first, and then repetitions within each drawn rig,
    both with replacement (Davison and Hinkley, Bootstrap Methods, 1997, 3.8). With four rigs there are only
    35 different draws of rigs: such an interval is rather too narrow than too wide.
    """
    rng = np.random.default_rng(seed)
    found = []
    for _ in range(resamples):
        rigs = [groups[index] for index in rng.integers(0, len(groups), len(groups))]
        found.append(statistic([[rig[i] for i in rng.integers(0, len(rig), len(rig))] for rig in rigs]))
    low, high = np.nanpercentile(found, (2.5, 97.5))
    return float(low), float(high)
