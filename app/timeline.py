"""Lanes of a timeline: pictures of a window of simulated time, whose cost does not grow with the events."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol

import cv2
import numpy as np
from numpy.typing import NDArray

from app.drawing.colors import LOSS, TARGET
from pipeline.types import ByteArray, FloatArray

Color = tuple[int, int, int]

PAPER, STRIPE, RULE = (250, 251, 252), (241, 243, 246), (226, 230, 234)
FAINTEST = 0.35
"""Strength of a pixel of whose time hardly anything is taken."""
NEAR_PX = 4.0
"""Frames at least so far apart on average are shown one by one, others as rates."""
RATE_PX = 9
"""Neighbouring pixels over which a rate of losses is taken, so that it can be read and does not flicker."""
ROWS_PX, ROW_PX = 216, (4, 24)
"""Height of all rows if they fit, and of the lowest and the highest row."""
BEFORE = 8
"""Frames before the nearest start among which one that is still on the air is looked for."""


@dataclass(frozen=True, slots=True)
class Label:
    """A word beside a lane."""

    y_px: float
    """Its middle, from the lane's upper edge."""
    text: str
    color: Color = (70, 78, 86)


class Lane(Protocol):
    """What a dock shows below its buttons: one picture of any window of time, and what is in it."""

    title: str
    height_px: int
    grows: bool
    """Whether what lies after the clock is not known yet and shown faintly."""
    legend: Sequence[tuple[str, Color]]
    """What its colours mean."""

    def draw(self, picture: ByteArray, start_ns: int, end_ns: int) -> None:
        """Paint (height, width, 3) RGB of the window."""

    def labels(self, now_ns: int) -> Sequence[Label]:
        """What stands to the left of the picture while the clock shows ``now_ns``."""

    def pick(self, t_ns: int, y_px: int, tolerance_ns: int) -> int:
        """The nearest item, or -1."""

    def describe(self, item: int) -> str:
        """One line about an item."""

    def place(self, item: int) -> tuple[int, int, int, int]:
        """Start and end in ns, upper and lower edge in px of an item."""


# Frames.


@dataclass(frozen=True, slots=True)
class Levels:
    """Frames by row and time, with sums from which any window at any zoom is counted exactly.

    The sums run over the frames of all rows, one row after the other; those over a time wrap around like
    all int64, which leaves their differences exact.
    """

    row_at: NDArray[np.int64]
    """(R + 1,) where each row begins in the other arrays."""
    item: NDArray[np.int32]
    """(F,) index of each frame as it was given."""
    start_ns: NDArray[np.int64]
    """(F,) ascending in each row."""
    end_ns: NDArray[np.int64]
    """(F,) of the same frames."""
    lost: NDArray[np.bool_]
    """(F,) whether nobody received it who should have."""
    edges: tuple[Edges, Edges]
    """Of all frames, and of the lost ones."""


@dataclass(frozen=True, slots=True)
class Edges:
    """Starts and ends of some frames, each ascending in each row, and sums of them."""

    row_at: NDArray[np.int64]
    start_ns: NDArray[np.int64]
    end_ns: NDArray[np.int64]
    start_sum_ns: NDArray[np.int64]
    """(F + 1,) of the starts before each."""
    end_sum_ns: NDArray[np.int64]

    def until(self, row: int, t_ns: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """(T,) frames of a row that have begun before each time, and the ns they had taken by then."""
        begin, end = int(self.row_at[row]), int(self.row_at[row + 1])
        begun = begin + np.searchsorted(self.start_ns[begin:end], t_ns)
        ended = begin + np.searchsorted(self.end_ns[begin:end], t_ns)
        since = (begun - ended) * t_ns
        taken = since - (self.start_sum_ns[begun] - self.start_sum_ns[begin])
        return begun - begin, taken + (self.end_sum_ns[ended] - self.end_sum_ns[begin])


def levels_of(
    start_ns: NDArray[np.int64],
    end_ns: NDArray[np.int64],
    row: NDArray[np.integer],
    lost: NDArray[np.bool_],
    rows: int,
) -> Levels:
    """The frames (F,) of so many rows, sorted and summed up once; a second for a million.

    Args:
        start_ns: when each frame begins.
        end_ns: and ends; not before.
        row: in which row it is.
        lost: whether it was.
        rows: of the lane; there may be empty ones.
    """
    order = np.lexsort((start_ns, row))
    starts, ends, lost = start_ns[order], end_ns[order], lost[order]
    at = row[order]
    some = tuple(_edges(starts[chosen], ends[chosen], at[chosen], rows) for chosen in (slice(None), lost))
    return Levels(some[0].row_at, order.astype(np.int32), starts, ends, lost, (some[0], some[1]))


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
    taken_ns: NDArray[np.int64]
    """(R, W) of the part's time that is taken by frames, also by those begun before."""
    lost_ns: NDArray[np.int64]


def counts_of(levels: Levels, start_ns: int, end_ns: int, parts: int) -> Counts:
    """Frames and air time in equal parts of a window."""
    edges_ns = start_ns + np.arange(parts + 1, dtype=np.int64) * (end_ns - start_ns) // parts
    rows = len(levels.row_at) - 1
    sums = np.empty((2, 2, rows, parts), np.int64)
    for which, edges in enumerate(levels.edges):
        for row in range(rows):
            begun, taken = edges.until(row, edges_ns)
            sums[which, 0, row], sums[which, 1, row] = np.diff(begun), np.diff(taken)
    return Counts(sums[0, 0], sums[1, 0], sums[0, 1], sums[1, 1])


class FramesLane:
    """One row a node: its frames on the air; lost ones are red when near and a rate when far."""

    title = "Frames"
    grows = False
    legend = (("frame on the air", TARGET), ("lost", LOSS))

    def __init__(self, levels: Levels, names: Sequence[str], about: Callable[[int], str]) -> None:
        """Show frames.

        Args:
            levels: of the frames.
            names: of the rows, from the top.
            about: one line about the frame with an index.
        """
        self._levels, self._names, self._about = levels, tuple(names), about
        self._at = np.argsort(levels.item)
        least, most = ROW_PX
        self._row_px = min(max(ROWS_PX // max(len(names), 1), least), most)
        self.height_px = self._row_px * len(names)

    def draw(self, picture: ByteArray, start_ns: int, end_ns: int) -> None:
        """Paint the frames of the window."""
        width = picture.shape[1]
        counts = counts_of(self._levels, start_ns, end_ns, width)
        fullest = counts.frames.sum(axis=1).max(initial=0)
        cells = self._near(counts) if fullest * NEAR_PX <= width else self._far(counts)
        picture[:] = cells.reshape(self.height_px, width, 3)

    def labels(self, now_ns: int) -> Sequence[Label]:
        """The nodes' names, as many as there is room for."""
        every = -(-12 // self._row_px)
        return [
            Label((row + 0.5) * self._row_px, name)
            for row, name in enumerate(self._names)
            if row % every == 0
        ]

    def pick(self, t_ns: int, y_px: int, tolerance_ns: int) -> int:
        """The frame at a place, or the nearest in its row."""
        row = y_px // self._row_px
        if not 0 <= row < len(self._names):
            return -1
        levels = self._levels
        begin, end = int(levels.row_at[row]), int(levels.row_at[row + 1])
        at = begin + int(np.searchsorted(levels.start_ns[begin:end], t_ns, side="right"))
        some = slice(max(at - BEFORE, begin), min(at + 1, end))
        away = np.maximum(levels.start_ns[some] - t_ns, t_ns - levels.end_ns[some])
        if not len(away):
            return -1
        nearest = len(away) - 1 - int(np.argmin(np.maximum(away, 0)[::-1]))
        return int(levels.item[some][nearest]) if away[nearest] <= tolerance_ns else -1

    def describe(self, item: int) -> str:
        """One line about a frame."""
        return self._about(item)

    def place(self, item: int) -> tuple[int, int, int, int]:
        """Where a frame is."""
        levels, at = self._levels, int(self._at[item])
        row = int(np.searchsorted(levels.row_at, at, side="right")) - 1
        edges = row * self._row_px, (row + 1) * self._row_px - 1
        return int(levels.start_ns[at]), int(levels.end_ns[at]), *edges

    def _paper(self, width: int) -> FloatArray:
        """(R, row_px, W, 3), every other row a little darker."""
        paper = np.empty((len(self._names), self._row_px, width, 3), np.float32)
        paper[0::2], paper[1::2] = PAPER, STRIPE
        return paper

    def _near(self, counts: Counts) -> FloatArray:
        cells = self._paper(counts.frames.shape[1])
        share = counts.taken_ns / max(int(counts.taken_ns.max(initial=0)), 1)
        _blend(cells[:, :-1], _strength(np.maximum(share, counts.frames > 0)), TARGET)
        lost = np.maximum(counts.lost_ns > 0, counts.lost > 0)
        lost[:, 1:] |= counts.lost[:, :-1] > 0
        _blend(cells[:, :-1], lost.astype(np.float32), LOSS)
        return cells

    def _far(self, counts: Counts) -> FloatArray:
        cells = self._paper(counts.frames.shape[1])
        strip = max(1, round(0.3 * self._row_px))
        most = max(int(counts.taken_ns.max(initial=0)), 1)
        taken = _strength(counts.taken_ns / most)
        _blend(cells[:, : -1 - strip], taken, TARGET)
        frames, lost = (cv2.blur(c.astype(np.float32), (RATE_PX, 1)) for c in (counts.frames, counts.lost))
        rate = np.where(counts.taken_ns > 0, lost / np.maximum(frames, 1e-6), 0.0)
        _blend(cells[:, -1 - strip : -1], np.clip(rate, 0.0, 1.0), LOSS)
        return cells


def _strength(share: FloatArray) -> FloatArray:
    return np.where(share > 1e-7, FAINTEST + (1.0 - FAINTEST) * share, 0.0)


def _blend(cells: FloatArray, strength: FloatArray, color: Color) -> None:
    """Lay (R, W) of a colour over (R, H, W, 3)."""
    cells += strength[:, None, :, None].astype(np.float32) * (np.array(color, np.float32) - cells)


# Curves.


@dataclass(frozen=True, slots=True)
class Curve:
    """A quantity that holds from each of its times to the next."""

    name: str
    unit: str
    color: Color
    t_ns: NDArray[np.int64]
    """(T,) ascending."""
    values: FloatArray
    """(T,) NaN where there is none."""
    low: float = 0.0
    high: float = 1.0
    """Values at the lower and upper edge of the lane."""

    def at(self, now_ns: int) -> float:
        """The value at a time; NaN before the first."""
        index = int(np.searchsorted(self.t_ns, now_ns, side="right")) - 1
        return float(self.values[index]) if index >= 0 else float("nan")


class CurvesLane:
    """Curves, each on a scale of its own; beside them what they are at the clock."""

    grows = True

    def __init__(self, title: str, curves: Sequence[Curve], height_px: int = 72) -> None:
        """Show curves in so many pixels."""
        self.title, self.height_px, self._curves = title, height_px, tuple(curves)
        self.legend = tuple((curve.name, curve.color) for curve in curves)

    def draw(self, picture: ByteArray, start_ns: int, end_ns: int) -> None:
        """Paint the curves in the window."""
        picture[:] = PAPER
        picture[[0, self.height_px // 2, -1]] = RULE
        for curve in self._curves:
            self._draw_curve(picture, curve, start_ns, end_ns)

    def labels(self, now_ns: int) -> Sequence[Label]:
        """Name and value of each curve."""
        gap = self.height_px / (len(self._curves) + 1)
        return [
            Label((index + 1) * gap, f"{curve.name} {_value_text(curve.at(now_ns), curve.unit)}", curve.color)
            for index, curve in enumerate(self._curves)
        ]

    def pick(self, t_ns: int, y_px: int, tolerance_ns: int) -> int:
        """Curves have no items."""
        return -1

    def describe(self, item: int) -> str:
        """Nothing."""
        return ""

    def place(self, item: int) -> tuple[int, int, int, int]:
        """Nowhere."""
        raise IndexError(item)

    def _draw_curve(self, picture: ByteArray, curve: Curve, start_ns: int, end_ns: int) -> None:
        height, width = picture.shape[:2]
        # The value at the middle of each pixel's time: as many as are seen, however many there are.
        middles_ns = start_ns + (2 * np.arange(width, dtype=np.int64) + 1) * (end_ns - start_ns) // (
            2 * width
        )
        at = np.searchsorted(curve.t_ns, middles_ns, side="right") - 1
        values = np.where(at >= 0, curve.values[np.maximum(at, 0)], np.nan) if len(curve.t_ns) else []
        share = np.clip((np.asarray(values) - curve.low) / (curve.high - curve.low), 0.0, 1.0)
        there = np.flatnonzero(np.isfinite(share))
        for run in np.split(there, np.flatnonzero(np.diff(there) > 1) + 1):
            if len(run):
                y = 16.0 * (2.0 + (height - 5.0) * (1.0 - share[run]))
                points = np.stack([16.0 * run, y], axis=1).round().astype(np.int32)
                cv2.polylines(picture, [points], False, curve.color, 2, cv2.LINE_AA, shift=4)


def _value_text(value: float, unit: str) -> str:
    if not np.isfinite(value):
        return "–"
    if unit == "%":
        return f"{value:.0f} %"
    return f"{value:.3g} {unit}".rstrip()
