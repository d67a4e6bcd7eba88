"""95 % intervals of runs, and chart lines with these intervals as bands."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from lab.claims.exhibits import Curve
from network_sim.replicate import t_interval


def interval(values: Iterable[float]) -> tuple[float, float, float]:
    """Return mean, low and high by Student's t; all three are equal for a single value."""
    mean, half = t_interval(values)
    return mean, mean - (half or 0.0), mean + (half or 0.0)


def curve(label: str, x: Sequence[float], runs: Sequence[Iterable[float]]) -> Curve:
    """Return means with intervals, one group of runs for each ``x``."""
    means, lows, highs = zip(*(interval(values) for values in runs), strict=True)
    return Curve(label, tuple(float(value) for value in x), means, lows, highs)
