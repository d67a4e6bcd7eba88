"""Radio frames by row and time, with running sums that give exact counts in any time window."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, slots=True)
class Sums:
    """Start times, or end times, of the frames in each row, with running sums over the frames before each.

    Sums of times may overflow int64; wrap-around leaves their differences exact.
    """

    t_ns: NDArray[np.int64]
    """(F,) times, ascending in each row, one row after the other."""
    before: NDArray[np.int64]
    """(F + 1, 4) running sums: number of frames and sum of their times, then both for the lost frames."""

    def until(self, first: int, last: int, t_ns: NDArray[np.int64]) -> NDArray[np.int64]:
        """Return (T, 4) sums over the frames of [first, last) before each of (T,) ascending times."""
        # Most of the row is outside a narrow window: find the window first, then the times within it.
        low, high = first + np.searchsorted(self.t_ns[first:last], (t_ns[0], t_ns[-1]))
        at = low + np.searchsorted(self.t_ns[low:high], t_ns)
        return self.before[at] - self.before[first]


@dataclass(frozen=True, slots=True)
class Levels:
    """Frames sorted by row and time, with their running sums."""

    row_at: NDArray[np.int64]
    """(R + 1,) index at which each row starts in the other arrays."""
    item: NDArray[np.int32]
    """(F,) index of each frame in the input; this and the arrays below are sorted by row, then by start."""
    start_ns: NDArray[np.int64]
    """(F,) start of each frame; ``end_ns`` is its end."""
    end_ns: NDArray[np.int64]
    cause: NDArray[np.int8]
    """(F,) cause of the loss; 0 if the frame was not lost."""
    begun: Sums
    ended: Sums

    @property
    def rows(self) -> int:
        """Number of rows."""
        return len(self.row_at) - 1

    def row(self, index: int) -> tuple[int, int]:
        """Return the index of a row's first frame, and the index after its last."""
        return int(self.row_at[index]), int(self.row_at[index + 1])

    def near(self, row: int, start_ns: int, end_ns: int) -> tuple[int, int]:
        """Return the range [first, last) of a row's frames that start in the time span [start_ns, end_ns)."""
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
    """Sort (F,) frames by row and time and compute their running sums.

    Args:
        start_ns: start of each frame.
        end_ns: end of each frame; not before its start.
        row: row of each frame. Frames in a row may overlap.
        cause: cause of the loss, up to 127; 0 if the frame was not lost.
        rows: number of rows; rows may be empty.
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
    """Frames and air time in each of W equal parts of a time window, for each of R rows."""

    frames: NDArray[np.int64]
    """(R, W) frames that start in the part."""
    lost: NDArray[np.int64]
    """(R, W) lost frames that start in the part."""
    taken_ns: NDArray[np.int64]
    """(R, W) air time in the part, including that of frames that started earlier."""
    lost_ns: NDArray[np.int64]
    """(R, W) air time of lost frames in the part."""


def counts_of(levels: Levels, start_ns: int, end_ns: int, parts: int) -> Counts:
    """Return the frames and the air time in equal parts of a time window."""
    edges_ns = start_ns + np.arange(parts + 1, dtype=np.int64) * (end_ns - start_ns) // parts
    begun = np.empty((levels.rows, parts + 1, 4), np.int64)
    ended = np.empty_like(begun)
    for row in range(levels.rows):
        begun[row] = levels.begun.until(*levels.row(row), edges_ns)
        ended[row] = levels.ended.until(*levels.row(row), edges_ns)
    counts = []
    for number, times in ((0, 1), (2, 3)):
        # A frame is on the air after its start and before its end.
        on_air = begun[..., number] - ended[..., number]
        taken_ns = on_air * edges_ns - (begun[..., times] - ended[..., times])
        counts += [np.diff(begun[..., number]), np.diff(taken_ns)]
    return Counts(frames=counts[0], taken_ns=counts[1], lost=counts[2], lost_ns=counts[3])
