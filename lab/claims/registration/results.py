"""The benchmark's results by entrant and condition."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from pipeline.config import Direction
from pipeline.types import FloatArray


class Results:
    """All trials of a benchmark; the values of all entrants have the same order of cases.

    Args:
        trials: trials from ``run_case``, case by case.
        cells: cells of the capture ranges.
    """

    def __init__(self, trials: Iterable[dict[str, Any]], cells: Iterable[dict[str, Any]] = ()) -> None:
        self._trials: dict[tuple[str, Direction, str], list[dict[str, Any]]] = {}
        self.cells = list(cells)
        for trial in trials:
            key = (trial["condition"], trial["direction"], trial["entrant"])
            self._trials.setdefault(key, []).append(trial)

    @property
    def conditions(self) -> tuple[str, ...]:
        """Conditions that were run, in order."""
        return tuple(dict.fromkeys(condition for condition, _, _ in self._trials))

    def entrants(self, conditions: Sequence[str], direction: Direction = "q2p") -> tuple[str, ...]:
        """Return the entrants that took part in all these conditions."""
        everyone = dict.fromkeys(entrant for _, _, entrant in self._trials)
        return tuple(e for e in everyone if all((c, direction, e) in self._trials for c in conditions))

    def trials(
        self, entrant: str, conditions: Sequence[str], direction: Direction = "q2p"
    ) -> list[dict[str, Any]]:
        """Return an entrant's trials, condition by condition, room by room; empty if it did not take part."""
        return [t for c in conditions for t in self._trials.get((c, direction, entrant), [])]

    def values(
        self,
        entrant: str,
        conditions: Sequence[str],
        name: str = "point_error_cm",
        direction: Direction = "q2p",
    ) -> FloatArray:
        """Return (N,) one measure of each of an entrant's trials; NaN where a trial has none."""
        found = (trial[name] for trial in self.trials(entrant, conditions, direction))
        return np.array([np.nan if value is None else float(value) for value in found])
