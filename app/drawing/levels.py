"""Frames on the air by row and time, summed up once so that any window at any zoom is counted exactly."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, slots=True)
class Sums:
    """Moments at which frames begin, or end, in each row, and what comes before each.

    Sums of times may wrap around, as int64 do; that leaves their differences exact.
    """

    t_ns: NDArray[np.int64]
    """(F,) ascending in each row, one row after the other."""
    before: NDArray[np.int64]
    """(F + 1, 4): of all before each, how many, the sum of their times, and the same of the lost ones."""

    def until(self, first: int, last: int, t_ns: NDArray[np.int64]) -> NDArray[np.int64]:
        """(T, 4) the same for those of a row, from ``first`` on, that come before each of ascending times."""
        # Most of the row lies outside a narrow window: it is searched twice, not for every pixel.
        low, high = first + np.searchsorted(self.t_ns[first:last], (t_ns[0], t_ns[-1]))
        at = low + np.searchsorted(self.t_ns[low:high], t_ns)
        return self.before[at] - self.before[first]


@dataclass(frozen=True, slots=True)
class Levels:
    """Frames by row and time."""

    row_at: NDArray[np.int64]
    """(R + 1,) where each row begins in the other arrays."""
    item: NDArray[np.int32]
    """(F,) index of each frame as it was given; by row, then by start, as what follows."""
    start_ns: NDArray[np.int64]
    end_ns: NDArray[np.int64]
    cause: NDArray[np.int8]
    """(F,) why it was lost; 0 if it was not."""
    begun: Sums
    ended: Sums

    @property
    def rows(self) -> int:
        """How many."""
        return len(self.row_at) - 1

    def row(self, index: int) -> tuple[int, int]:
        """First frame of a row, and the first behind it."""
        return int(self.row_at[index]), int(self.row_at[index + 1])

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
    by_end = np.lexsort((end_ns, row))
    return Levels(
        row_at=np.searchsorted(row[order], np.arange(rows + 1)),
        item=order.astype(np.int32),
        start_ns=start_ns[order],
        end_ns=end_ns[order],
        cause=cause[order].astype(np.int8),
        begun=_sums(start_ns[order], cause[order] > 0),
        ended=_sums(end_ns[by_end], cause[by_end] > 0),
    )


def _sums(t_ns: NDArray[np.int64], lost: NDArray[np.bool_]) -> Sums:
    before = np.zeros((len(t_ns) + 1, 4), np.int64)
    columns = (np.ones_like(t_ns), t_ns, lost, np.where(lost, t_ns, 0))
    for index, column in enumerate(columns):
        np.cumsum(column, dtype=np.int64, out=before[1:, index])
    return Sums(t_ns, before)


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
    begun = np.empty((levels.rows, parts + 1, 4), np.int64)
    ended = np.empty_like(begun)
    for row in range(levels.rows):
        begun[row] = levels.begun.until(*levels.row(row), edges_ns)
        ended[row] = levels.ended.until(*levels.row(row), edges_ns)
    counts = []
    for number, times in ((0, 1), (2, 3)):
        # A frame has been on the air since its start, but not since its end.
        on_air = begun[..., number] - ended[..., number]
        taken_ns = on_air * edges_ns - (begun[..., times] - ended[..., times])
        counts += [np.diff(begun[..., number]), np.diff(taken_ns)]
    return Counts(frames=counts[0], taken_ns=counts[1], lost=counts[2], lost_ns=counts[3])
