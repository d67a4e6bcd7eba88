"""A chart of programs by two measures, both on logarithmic axes, as an SVG picture."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from html import escape
from math import ceil, floor, log10

from lab.results.chart import BOTTOM, COLORS, HEIGHT, LEFT, RIGHT, TOP, WIDTH, document, titled

STEPS = (1, 2, 5)
"""Numbers on an axis within a decade."""


@dataclass(frozen=True, slots=True)
class Mark:
    """A program's mark in the chart; all values above 0."""

    label: str
    x: float
    y: float
    y_worst: float | None
    """Other end of the bar; None for no bar."""
    hollow: bool = False
    """Whether only the outline of the mark is drawn, to distinguish a second case."""


@dataclass(frozen=True, slots=True)
class _Axis:
    """A logarithmic axis from ``low`` to ``high`` over ``length_px`` from ``start_px``."""

    low: float
    high: float
    start_px: float
    length_px: float

    def at(self, value: float) -> float:
        """Return the position of a value."""
        share = log10(value / self.low) / log10(self.high / self.low)
        return self.start_px + self.length_px * share

    def ticks(self) -> list[float]:
        """Return the round numbers within the axis."""
        decades = range(floor(log10(self.low)), ceil(log10(self.high)) + 1)
        return [s * 10.0**k for k in decades for s in STEPS if self.low <= s * 10.0**k <= self.high]


def scatter(x_label: str, y_label: str, marks: Sequence[Mark]) -> str:
    """Return an SVG picture: a mark for each program, with a bar to its worst value.

    Args:
        x_label: text below.
        y_label: text on the left.
        marks: the programs; those of one label share a colour and a line of the legend.
    """
    ys = [y for mark in marks for y in (mark.y, mark.y_worst) if y is not None]
    xs = [mark.x for mark in marks]
    across = _Axis(min(xs) / 1.4, max(xs) * 1.4, LEFT, WIDTH - LEFT - RIGHT)
    up = _Axis(min(ys) / 1.4, max(ys) * 1.4, HEIGHT - BOTTOM, TOP + BOTTOM - HEIGHT)
    parts = [_frame(x_label, y_label, across, up)]
    labels = dict.fromkeys(mark.label for mark in marks)
    colors = {label: COLORS[k % len(COLORS)] for k, label in enumerate(labels)}
    parts += [_mark(mark, colors[mark.label], across, up) for mark in marks]
    for k, (label, color) in enumerate(colors.items()):
        x, y = WIDTH - RIGHT + 15, TOP + 14 + 22 * k
        parts.append(f'<circle cx="{x + 11}" cy="{y}" r="4" fill="{color}"/>')
        parts.append(f'<text x="{x + 24}" y="{y + 4}">{escape(label)}</text>')
    return document(parts)


def _frame(x_label: str, y_label: str, across: _Axis, up: _Axis) -> str:
    """Return background, axes and their texts."""
    right, bottom = WIDTH - RIGHT, HEIGHT - BOTTOM
    parts = titled(x_label, y_label)
    for value in across.ticks():
        x = across.at(value)
        parts.append(f'<path d="M{x:.1f} {TOP}V{bottom}" stroke="#dddddd"/>')
        parts.append(f'<text x="{x:.1f}" y="{bottom + 18}" text-anchor="middle">{value:g}</text>')
    for value in up.ticks():
        y = up.at(value)
        parts.append(f'<path d="M{LEFT} {y:.1f}H{right}" stroke="#dddddd"/>')
        parts.append(f'<text x="{LEFT - 6}" y="{y + 4:.1f}" text-anchor="end">{value:g}</text>')
    return "\n".join(parts)


def _mark(mark: Mark, color: str, across: _Axis, up: _Axis) -> str:
    x, y = across.at(mark.x), up.at(mark.y)
    bar = ""
    if mark.y_worst is not None:
        bar = f'<path d="M{x:.1f} {y:.1f}V{up.at(mark.y_worst):.1f}" stroke="{color}" stroke-width="1.5"/>\n'
    fill = "#ffffff" if mark.hollow else color
    return f'{bar}<circle cx="{x:.1f}" cy="{y:.1f}" r="5" fill="{fill}" stroke="{color}" stroke-width="2"/>'
