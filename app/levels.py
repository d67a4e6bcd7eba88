"""Frames on the air by row and time, summed up once so that any window at any zoom is counted exactly."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, slots=True)
class Edges:
    """Starts and ends of some frames, each ascending in each row, one row after the other.

    Sums of times may wrap around, as int64 do; that leaves their differences exact.
    """

    row_at: NDArray[np.int64]
    """(R + 1,) where each row begins in the other arrays."""
    start_ns: NDArray[np.int64]
    """(F,)."""
    end_ns: NDArray[np.int64]
    """(F,) not of the same frames."""
    start_sum_ns: NDArray[np.int64]
    """(F + 1,) of the starts before each."""
    end_sum_ns: NDArray[np.int64]

    def until(self, row: int, t_ns: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """(T,) frames of a row that have begun before each time, and the air time they had taken by then."""
        first, last = int(self.row_at[row]), int(self.row_at[row + 1])
        begun = first + np.searchsorted(self.start_ns[first:last], t_ns)
        ended = first + np.searchsorted(self.end_ns[first:last], t_ns)
        starts_ns = self.start_sum_ns[begun] - self.start_sum_ns[first]
        ends_ns = self.end_sum_ns[ended] - self.end_sum_ns[first]
        return begun - first, (begun - ended) * t_ns - starts_ns + ends_ns


@dataclass(frozen=True, slots=True)
class Levels:
    """Frames by row and time."""

    every: Edges
    """Of all frames."""
    lost: Edges
    """Of the lost ones."""
    item: NDArray[np.int32]
    """(F,) index of each frame as it was given; by row, then by start, as what follows."""
    start_ns: NDArray[np.int64]
    end_ns: NDArray[np.int64]
    cause: NDArray[np.int8]
    """(F,) why it was lost; 0 if it was not."""

    @property
    def rows(self) -> int:
        """How many."""
        return len(self.every.row_at) - 1

    def row(self, index: int) -> tuple[int, int]:
        """First frame of a row, and the first behind it."""
        return int(self.every.row_at[index]), int(self.every.row_at[index + 1])

    def near(self, row: int, start_ns: int, end_ns: int) -> tuple[int, int]:
        """First frame of a row that begins in a span of time, and the first that begins behind it."""
        first, last = self.row(row)
        begin, end = np.searchsorted(self.start_ns[first:last], (start_ns, end_ns))
        return first + int(begin), first + int(end)


def levels_of(
    start_ns: NDArray[np.int64],
    end_ns: NDArray[np.int64],
    row: NDArray[np.integer],
    cause: NDArray[np.integer],
    rows: int,
) -> Levels:
    """The frames (F,) of so many rows, sorted and summed up.

    Args:
        start_ns: when each frame begins.
        end_ns: and ends; not before.
        row: in which row it is. Frames in a row may overlap.
        cause: why it was lost, up to 127; 0 if it was not.
        rows: how many; there may be empty ones.
    """
    order = np.lexsort((start_ns, row))
    starts, ends, at = start_ns[order], end_ns[order], row[order]
    causes = cause[order].astype(np.int8)
    lost = causes > 0
    return Levels(
        every=_edges(starts, ends, at, rows),
        lost=_edges(starts[lost], ends[lost], at[lost], rows),
        item=order.astype(np.int32),
        start_ns=starts,
        end_ns=ends,
        cause=causes,
    )


def _edges(starts: NDArray[np.int64], ends: NDArray[np.int64], row: NDArray[np.integer], rows: int) -> Edges:
    ends = ends[np.lexsort((ends, row))]
    sums = [np.concatenate([[0], np.cumsum(t_ns, dtype=np.int64)]) for t_ns in (starts, ends)]
    return Edges(np.searchsorted(row, np.arange(rows + 1)), starts, ends, sums[0], sums[1])


@dataclass(frozen=True, slots=True)
class Counts:
    """What happens in each of W equal parts of a window, in each of R rows."""

    frames: NDArray[np.int64]
    """(R, W) that begin there."""
    lost: NDArray[np.int64]
    """(R, W) of them that are lost."""
    taken_ns: NDArray[np.int64]
    """(R, W) air time in the part, also of frames that began before it."""
    lost_ns: NDArray[np.int64]
    """(R, W) of it that lost frames took."""


def counts_of(levels: Levels, start_ns: int, end_ns: int, parts: int) -> Counts:
    """Frames and air time in equal parts of a window."""
    edges_ns = start_ns + np.arange(parts + 1, dtype=np.int64) * (end_ns - start_ns) // parts
    begun, taken = np.empty((2, 2, levels.rows, parts), np.int64)
    for which, edges in enumerate((levels.every, levels.lost)):
        for row in range(levels.rows):
            until = edges.until(row, edges_ns)
            begun[which, row], taken[which, row] = np.diff(until[0]), np.diff(until[1])
    return Counts(begun[0], begun[1], taken[0], taken[1])
