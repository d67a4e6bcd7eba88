"""Exchange rates, with intervals over rigs and their repetitions.

Every statistic here is a mean over rigs of a ratio of sums. A repetition is represented by its terms in these
sums.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence

import numpy as np

from pipeline.types import FloatArray

Groups = Sequence[FloatArray]
"""(S, K) terms of each rig's S repetitions."""
Estimate = tuple[float, tuple[float, float]]
"""A value with its 95 % interval."""
RESAMPLES = 2000


def slope_terms(lost: Iterable[float], cost: Iterable[float]) -> FloatArray:
    """Return (2,) terms whose ratio is the cost of a unit of ``lost``: least squares through the origin.

    The line goes through the origin because zero losses cost nothing.
    """
    x, y = np.array(list(lost), float), np.array(list(cost), float)
    return np.array([x @ y, x @ x])


def mean_terms(values: Iterable[float]) -> FloatArray:
    """Return (S, 2) terms whose ratio is the mean of the values."""
    column = np.array(list(values), float)
    return np.column_stack([column, np.ones_like(column)])


def mean_ratio(sums: FloatArray) -> FloatArray:
    """Return (...) means over rigs of the ratios of (..., R, 2) sums; NaN if a rig's second sum is 0."""
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.mean(sums[..., 0] / sums[..., 1], axis=-1)


def difference(sums: FloatArray) -> FloatArray:
    """Return (...) first minus second mean ratio of (..., R, 4) sums of the same repetitions."""
    return mean_ratio(sums[..., :2]) - mean_ratio(sums[..., 2:])


def estimate(groups: Groups, statistic: Callable[[FloatArray], FloatArray] = mean_ratio) -> Estimate:
    """Return a statistic with its interval over rigs and repetitions."""
    return float(statistic(np.stack([rig.sum(axis=0) for rig in groups]))), resampled_ci95(groups, statistic)


def resampled_ci95(
    groups: Groups,
    statistic: Callable[[FloatArray], FloatArray] = mean_ratio,
    seed: int = 0,
    resamples: int = RESAMPLES,
) -> tuple[float, float]:
    """Return the 95 % percentile bootstrap interval of a statistic.

    The statistic maps (resamples, R, K) sums of the terms of R rigs to (resamples,) values.
    Repetitions share their rig, so rigs are drawn first, and then repetitions within each drawn rig, both
    with replacement (Davison and Hinkley, Bootstrap Methods, 1997, 3.8). Four rigs have only 35 different
    draws: such an interval is rather too narrow than too wide.
    """
    rng = np.random.default_rng(seed)
    slots = len(groups)
    of_rig = [
        terms[rng.integers(0, len(terms), (resamples, slots, len(terms)))].sum(axis=2) for terms in groups
    ]
    drawn = rng.integers(0, slots, (resamples, slots))
    sums = np.take_along_axis(np.stack(of_rig), drawn[None, ..., None], axis=0)[0]
    low, high = np.nanpercentile(statistic(sums), (2.5, 97.5))
    return float(low), float(high)
