"""Lanes of a timeline: each draws any time window at a cost that hardly depends on its number of events."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import cv2
import numpy as np
from numpy.typing import NDArray

from app.drawing.colors import LOSS, TARGET
from app.drawing.levels import Levels, counts_of
from pipeline.types import ByteArray, FloatArray

Color = tuple[int, int, int]

PAPER, STRIPE, RULE = (250, 251, 252), (241, 243, 246), (222, 226, 231)
TEXT = (70, 78, 86)
FAINTEST = 0.35
"""Strength of a pixel that is nearly free of air time."""
NEAR_PX = 4.0
"""Frames at least this far apart on average are drawn one by one, others as rates."""
AROUND_PX = 9
"""Number of neighbouring pixels over which frames and losses are averaged, so that a rate is readable."""
ROWS_PX, ROW_PX = 120, (2, 24)
"""Height of all rows if they fit; lowest and highest row."""
DASH_PX = 12
"""Half the distance between the dashes of a curve."""
TICK_PX = 14
"""Height of a tick's text at the left edge."""
NAME_PX = 13
"""Height of a row's name."""
WORD_PX, WORDS = 56.0, 60
"""Least width of a frame that gets a word, and the largest number of words."""
FAINT_VEIL = 0.82
"""Veil over the time after the clock when its content may be faintly visible."""
BEFORE = 8
"""Number of frames before a time that are searched for one that is still on the air."""


@dataclass(frozen=True, slots=True)
class Label:
    """A text next to a lane."""

    y_px: float
    """Middle of the text, from the lane's upper edge."""
    text: str
    color: Color = TEXT


@dataclass(frozen=True, slots=True)
class Word:
    """A text in a lane's picture, centred in a time span."""

    start_ns: int
    end_ns: int
    y_px: float
    text: str


class Lane(Protocol):
    """A lane of a dock: it draws a picture of any time window and describes its content."""

    title: str
    height_px: int
    veil: float
    """Veil over the time after the clock: 0 leaves it visible, 1 hides it."""
    legend: Sequence[tuple[str, Color]]
    """Names and colours of the legend."""
    ticks: Sequence[Label]
    """Texts of values on the vertical axis, written at the left edge."""

    def draw(self, picture: ByteArray, start_ns: int, end_ns: int) -> None:
        """Draw the window into a (height, width, 3) RGB picture."""

    def labels(self, now_ns: int) -> Sequence[Label]:
        """Return the texts to the left of the picture at clock time ``now_ns``."""

    def words(self, start_ns: int, end_ns: int, width_px: int) -> Sequence[Word]:
        """Return the texts in a picture of this width."""

    def pick(self, t_ns: int, y_px: int, tolerance_ns: int) -> int:
        """Return the index of the item nearest to a place; -1 if none is within the tolerance."""

    def tip(self, t_ns: int, y_px: int, tolerance_ns: int) -> str:
        """Return one line about the items at a place; empty if there are none."""

    def place(self, item: int) -> tuple[int, int, int, int]:
        """Return an item's start and end in ns, and its upper and lower edge in px."""


class FramesLane:
    """One row per node with its radio frames; losses are red: single frames when zoomed in, else a rate."""

    title = "Frames"
    veil = 0.0
    legend: Sequence[tuple[str, Color]] = (
        ("frames on the air", TARGET),
        ("lost (zoomed out: share of frames lost)", LOSS),
    )
    ticks: Sequence[Label] = ()

    def __init__(
        self, levels: Levels, names: Sequence[str], about: Callable[[int], str], causes: Sequence[str]
    ) -> None:
        """Show frames.

        Args:
            levels: the frames, sorted.
            names: names of the rows from top to bottom.
            about: returns one line about the frame with an index.
            causes: causes of losses in a word or two; the first is for frames that were not lost.
        """
        self._levels, self._names, self._about = levels, tuple(names), about
        self._causes = tuple(causes)
        least, most = ROW_PX
        self._row_px = min(max(ROWS_PX // max(len(names), 1), least), most)
        self._gap_px = 1 if self._row_px > 4 else 0
        self.height_px = self._row_px * len(names)

    def draw(self, picture: ByteArray, start_ns: int, end_ns: int) -> None:
        """Draw the frames of the window."""
        width = picture.shape[1]
        counts = counts_of(self._levels, start_ns, end_ns, width)
        pixel_ns = (end_ns - start_ns) / width
        taken, lost = (ns.astype(np.float32) / pixel_ns for ns in (counts.taken_ns, counts.lost_ns))
        frames = _around(counts.frames)
        many = frames * NEAR_PX > 1.0
        share = FAINTEST + (1.0 - FAINTEST) * np.minimum(_around(taken), 1.0)
        rate = np.clip(_around(counts.lost) / np.maximum(frames, 1e-6), 0.0, 1.0)
        every, red = _one_by_one(counts.frames, taken), _one_by_one(counts.lost, lost)
        strip_px = max(1, round(0.3 * self._row_px))
        rows = picture.reshape(len(self._names), self._row_px, width, 3)
        rows[0::2], rows[1::2] = PAPER, STRIPE
        body = rows[:, : self._row_px - self._gap_px]
        _paint(body[:, :-strip_px], np.where(many, share, every), np.where(many, 0.0, red))
        _paint(body[:, -strip_px:], np.where(many, 0.0, every), np.where(many, np.sqrt(rate), red))

    def labels(self, now_ns: int) -> Sequence[Label]:
        """Return the nodes' names, as many as fit."""
        every = -(-NAME_PX // self._row_px)
        rows = range(0, len(self._names), every)
        return [Label((row + 0.5) * self._row_px, self._names[row]) for row in rows]

    def words(self, start_ns: int, end_ns: int, width_px: int) -> Sequence[Word]:
        """Return the causes of losses, where they fit."""
        if self._row_px < NAME_PX:
            return []
        levels, least_ns = self._levels, (end_ns - start_ns) * WORD_PX / width_px
        words: list[Word] = []
        for row in range(levels.rows):
            begin, end = levels.near(row, start_ns, end_ns)
            span = slice(max(begin - 1, levels.row(row)[0]), end)
            starts, ends, cause = levels.start_ns[span], levels.end_ns[span], levels.cause[span]
            seen_ns = np.minimum(ends, end_ns) - np.maximum(starts, start_ns)
            y_px = (row + 0.5) * self._row_px
            wide = np.flatnonzero((cause > 0) & (seen_ns >= least_ns))[:WORDS].tolist()
            words += [Word(int(starts[i]), int(ends[i]), y_px, self._causes[cause[i]]) for i in wide]
        return words[:WORDS]

    def pick(self, t_ns: int, y_px: int, tolerance_ns: int) -> int:
        """Return the input index of the frame at a place or nearest to it in its row; -1 if none is near."""
        row, levels = y_px // self._row_px, self._levels
        if not 0 <= row < levels.rows:
            return -1
        first, last = levels.row(row)
        at = first + int(np.searchsorted(levels.start_ns[first:last], t_ns, side="right"))
        some = slice(max(at - BEFORE, first), min(at + 1, last))
        away_ns = np.maximum(np.maximum(levels.start_ns[some] - t_ns, t_ns - levels.end_ns[some]), 0)
        if not len(away_ns) or away_ns.min() > tolerance_ns:
            return -1
        latest = len(away_ns) - 1 - int(np.argmin(away_ns[::-1]))
        return int(levels.item[some][latest])

    def tip(self, t_ns: int, y_px: int, tolerance_ns: int) -> str:
        """Return a line about the one frame at a place, or a count of frames and causes of losses."""
        item = self.pick(t_ns, y_px, tolerance_ns)
        if item < 0:
            return ""
        row = y_px // self._row_px
        begin, end = self._levels.near(row, t_ns - tolerance_ns, t_ns + tolerance_ns)
        if end - begin < 3:
            return self._about(item)
        by_cause = np.bincount(self._levels.cause[begin:end], minlength=1).tolist()
        why = ", ".join(f"{self._causes[cause]} {n:,}" for cause, n in enumerate(by_cause) if cause and n)
        lost = f"{end - begin - by_cause[0]:,} of them lost ({why})" if why else "none of them lost"
        return f"{self._names[row]}: {end - begin:,} frames within a few pixels, {lost}"

    def place(self, item: int) -> tuple[int, int, int, int]:
        """Return a frame's start, end and edges."""
        levels = self._levels
        at = int(np.flatnonzero(levels.item == item)[0])
        row = int(np.searchsorted(levels.row_at, at, side="right")) - 1
        edges = row * self._row_px, (row + 1) * self._row_px - self._gap_px
        return int(levels.start_ns[at]), int(levels.end_ns[at]), *edges


def _around(counts: NDArray[Any]) -> FloatArray:
    """Return (R, W) means over neighbouring pixels."""
    return cv2.blur(counts.astype(np.float32), (AROUND_PX, 1), borderType=cv2.BORDER_REPLICATE)


def _one_by_one(begun: NDArray[np.int64], taken: FloatArray) -> FloatArray:
    """Return (R, W) strength of frames at least a pixel wide, weaker where two frames touch."""
    strength = np.where((begun > 0) | (taken > 0.0), np.clip(taken, 0.75, 1.0), np.float32(0.0))
    touching = (begun[:, 1:] > 0) & (taken[:, :-1] > 0.5) & (taken[:, 1:] > 0.5)
    strength[:, 1:][touching] = 0.5
    return strength


def _paint(rows: ByteArray, frames: FloatArray, lost: FloatArray) -> None:
    """Draw frames, and lost ones over them, in (R, W) strengths onto (R, H, W, 3) rows."""
    for channel, (target, loss) in enumerate(zip(TARGET, LOSS, strict=True)):
        color = rows[:, 0, :, channel].astype(np.float32)
        color += frames * (target - color)
        color += lost * (loss - color)
        rows[..., channel] = color[:, None]


@dataclass(frozen=True, slots=True)
class Curve:
    """A quantity whose value holds from each of its times to the next."""

    name: str
    unit: str
    color: Color
    t_ns: NDArray[np.int64]
    """(T,) ascending."""
    values: FloatArray
    """(T,) values, NaN where there is none."""
    low: float = 0.0
    high: float = 1.0
    """Value at the lane's upper edge; ``low`` is at the lower one."""
    digits: int | None = None
    """Fixed decimals, so that a running number does not change its width; None: three digits in all."""
    dashed: bool = False

    def at(self, t_ns: NDArray[np.int64]) -> FloatArray:
        """Return the value at each of ``t_ns``, in an array of its shape; NaN before the first time."""
        index = np.searchsorted(self.t_ns, t_ns, side="right")
        return np.concatenate([[np.nan], self.values])[index]

    def text(self, now_ns: int) -> str:
        """Return the name and value at ``now_ns`` as text."""
        value = float(self.at(np.array(now_ns)))
        if not np.isfinite(value):
            return f"{self.name} –"
        number = f"{value:.3g}" if self.digits is None else f"{value:.{self.digits}f}"
        return f"{self.name} {number} {self.unit}".rstrip()


class CurvesLane:
    """Curves, each on its own scale, with their values at the clock's time as labels."""

    def __init__(
        self,
        title: str,
        curves: Sequence[Curve],
        height_px: int = 60,
        veil: float = FAINT_VEIL,
        titled: bool = False,
    ) -> None:
        """Add curves; ``veil`` is as in ``Lane``, and ``titled`` writes the title above the labels."""
        self.title, self.height_px, self.veil, self._curves = title, height_px, veil, tuple(curves)
        self._titled = titled
        self.legend: Sequence[tuple[str, Color]] = tuple((curve.name, curve.color) for curve in curves)
        self.ticks: Sequence[Label] = self._scale()

    def _scale(self) -> list[Label]:
        """Return ticks at both edges and in the middle, if all curves have the same scale."""
        scales = {(curve.low, curve.high, curve.unit) for curve in self._curves}
        if len(scales) != 1:
            return []
        ((low, high, unit),) = scales
        places = (
            (0.5 * TICK_PX, high),
            (0.5 * self.height_px, 0.5 * (low + high)),
            (self.height_px - 0.5 * TICK_PX, low),
        )
        return [Label(y_px, f"{value:g} {unit}".rstrip()) for y_px, value in places]

    def draw(self, picture: ByteArray, start_ns: int, end_ns: int) -> None:
        """Draw the curves in the window."""
        picture[:] = PAPER
        picture[[0, self.height_px // 2, -1]] = RULE
        pixels = 2 * np.arange(picture.shape[1], dtype=np.int64) + 1
        middles_ns = start_ns + pixels * (end_ns - start_ns) // (2 * len(pixels))
        for curve in self._curves:
            share = (curve.at(middles_ns) - curve.low) / (curve.high - curve.low)
            if curve.dashed:
                share[np.arange(len(share)) % (2 * DASH_PX) >= 1.3 * DASH_PX] = np.nan
            _draw_curve(picture, np.clip(share, 0.0, 1.0), curve.color)

    def labels(self, now_ns: int) -> Sequence[Label]:
        """Return the name and value of each curve, below the title if it is written."""
        title_px = NAME_PX if self._titled else 0
        gap_px = (self.height_px - title_px) / (len(self._curves) + 1)
        curves = [
            Label(title_px + (index + 1) * gap_px, curve.text(now_ns), curve.color)
            for index, curve in enumerate(self._curves)
        ]
        return [Label(0.5 * NAME_PX, self.title), *curves] if self._titled else curves

    def words(self, start_ns: int, end_ns: int, width_px: int) -> Sequence[Word]:
        """Return no words."""
        return []

    def pick(self, t_ns: int, y_px: int, tolerance_ns: int) -> int:
        """Return -1: curves have no items."""
        return -1

    def tip(self, t_ns: int, y_px: int, tolerance_ns: int) -> str:
        """Return the values at ``t_ns`` as text."""
        return ", ".join(curve.text(t_ns) for curve in self._curves)

    def place(self, item: int) -> tuple[int, int, int, int]:
        """Raise an error: curves have no items."""
        raise IndexError(item)


def round_up(value: float) -> float:
    """Round a positive value up to 1, 2, 4, 6, 8 or 10 times a power of ten, whose half is round, too."""
    power = 10.0 ** np.floor(np.log10(value))
    return float(next(times * power for times in (1.0, 2.0, 4.0, 6.0, 8.0, 10.0) if times * power >= value))


def _draw_curve(picture: ByteArray, share: FloatArray, color: Color) -> None:
    """Draw a line through (W,) shares of the height, with gaps at NaN."""
    there = np.flatnonzero(np.isfinite(share))
    for run in np.split(there, np.flatnonzero(np.diff(there) > 1) + 1):
        if len(run):
            y_px = 2.0 + (len(picture) - 5.0) * (1.0 - share[run])
            points = (16.0 * np.stack([run, y_px], axis=1)).round().astype(np.int32)
            cv2.polylines(picture, [points], False, color, 2, cv2.LINE_AA, shift=4)
