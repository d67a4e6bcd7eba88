"""95 % intervals of runs."""

from __future__ import annotations

from collections.abc import Iterable

from network_sim.replicate import t_interval


def interval(values: Iterable[float]) -> tuple[float, float, float]:
    """Mean, low and high by Student's t; all three alike for a single value."""
    mean, half = t_interval(values)
    return mean, mean - (half or 0.0), mean + (half or 0.0)
