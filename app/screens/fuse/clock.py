"""The clock of a race: iterations, or each method's run time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from app.dock.dock import COUNT_NS
from app.screens.fuse.view import RaceLane
from pipeline.types import FloatArray

CLOCKS = {"iterations": False, "milliseconds": True}
NS_PER_MS = 1_000_000


@dataclass(frozen=True, slots=True)
class RaceClock:
    """A clock from 0 to ``end_ns``; a lane that has ended stays at its last step."""

    steps_ns: tuple[NDArray[np.int64], ...]
    """One (K,) ascending array per lane: the time of each step; an iteration takes ``COUNT_NS``."""
    in_ms: bool

    @staticmethod
    def of(lanes: Sequence[RaceLane], in_ms: bool) -> RaceClock:
        """Return the clock of these lanes: by run time if ``in_ms``, otherwise by iteration."""
        if in_ms:
            times = tuple(np.array([round(1e9 * step.time_s) for step in lane.steps]) for lane in lanes)
        else:
            times = tuple(COUNT_NS * np.arange(len(lane.steps)) for lane in lanes)
        return RaceClock(times, in_ms)

    @property
    def end_ns(self) -> int:
        """Time at which the last lane reaches its last step."""
        return max(int(steps_ns[-1]) for steps_ns in self.steps_ns)

    @property
    def stops_ns(self) -> NDArray[np.int64]:
        """(S,) times at which any lane moves."""
        return np.unique(np.concatenate(self.steps_ns))

    def rows(self, now_ns: int) -> tuple[int, ...]:
        """Return the index of each lane's step at a time."""
        return tuple(int(np.searchsorted(steps_ns, now_ns, side="right")) - 1 for steps_ns in self.steps_ns)

    @property
    def label(self) -> str:
        """Label of the axis."""
        return "time, ms" if self.in_ms else "iteration"

    def shown(self, t_ns: NDArray[np.int64]) -> FloatArray:
        """Return times in the units of the axis, in an array of the same shape."""
        return t_ns / (NS_PER_MS if self.in_ms else COUNT_NS)

    def at(self, place: float | None) -> int:
        """Return the time, ns, of an iteration or of a number of milliseconds; None is the end."""
        return self.end_ns if place is None else round(place * (NS_PER_MS if self.in_ms else COUNT_NS))
