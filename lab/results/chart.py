"""A chart of shares with their intervals, as an SVG picture."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from html import escape

WIDTH, HEIGHT = 820, 400
LEFT, RIGHT, TOP, BOTTOM = 60, 265, 20, 50
"""Margins of the plot; the legend is to its right."""
COLORS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#000000", "#999999")
"""Colours that colour-blind people can tell apart (Okabe and Ito 2008)."""
SHIFT = 5.0
"""Horizontal distance of the marks of neighbouring series, so that their bars do not hide each other."""


@dataclass(frozen=True, slots=True)
class Series:
    """Shares at some of a chart's places; all values 0 to 1."""

    label: str
    shares: tuple[float | None, ...]
    """One for each place; None leaves a gap."""
    intervals: tuple[tuple[float, float] | None, ...]
    """Lower and upper end of the bar at each place; None draws no bar."""


def chart(x_label: str, y_label: str, places: Sequence[str], series: Sequence[Series]) -> str:
    """Return an SVG picture: a line for each series, with a mark and an interval bar at each place.

    Args:
        x_label: text below.
        y_label: text on the left.
        places: names of the places from left to right.
        series: one line each.
    """
    parts = [_frame(x_label, y_label, places)]
    for k, one in enumerate(series):
        color, shift = COLORS[k % len(COLORS)], SHIFT * (k - 0.5 * (len(series) - 1))
        parts.append(_line(one, color, shift, len(places)))
        y = TOP + 14 + 22 * k
        x = WIDTH - RIGHT + 15
        parts.append(f'<path d="M{x} {y}h22" stroke="{color}" stroke-width="2"/>')
        parts.append(f'<circle cx="{x + 11}" cy="{y}" r="3.5" fill="{color}"/>')
        parts.append(f'<text x="{x + 30}" y="{y + 4}">{escape(one.label)}</text>')
    return document(parts)


def document(parts: Sequence[str]) -> str:
    """Return the SVG picture that contains these elements."""
    body = "\n".join(parts)
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" '
        f'font-family="sans-serif" font-size="13">\n{body}\n</svg>\n'
    )


def titled(x_label: str, y_label: str) -> list[str]:
    """Return the white background and the texts below and on the left."""
    middle_x, middle_y = 0.5 * (LEFT + WIDTH - RIGHT), 0.5 * (TOP + HEIGHT - BOTTOM)
    turned = f'transform="translate(14 {middle_y:.1f}) rotate(-90)" text-anchor="middle"'
    return [
        f'<rect width="{WIDTH}" height="{HEIGHT}" fill="#ffffff"/>',
        f'<text x="{middle_x:.1f}" y="{HEIGHT - 8}" text-anchor="middle">{escape(x_label)}</text>',
        f"<text {turned}>{escape(y_label)}</text>",
    ]


def _x(place: int, count: int) -> float:
    """Return the x position of a place's middle."""
    return LEFT + (WIDTH - LEFT - RIGHT) * (place + 0.5) / count


def _y(share: float) -> float:
    return TOP + (HEIGHT - TOP - BOTTOM) * (1.0 - share)


def _frame(x_label: str, y_label: str, places: Sequence[str]) -> str:
    """Return background, axes and their texts."""
    right, bottom = WIDTH - RIGHT, HEIGHT - BOTTOM
    parts = titled(x_label, y_label)
    for percent in range(0, 101, 20):
        y = _y(percent / 100.0)
        parts.append(f'<path d="M{LEFT} {y:.1f}H{right}" stroke="#dddddd"/>')
        parts.append(f'<text x="{LEFT - 6}" y="{y + 4:.1f}" text-anchor="end">{percent} %</text>')
    for k, name in enumerate(places):
        x = _x(k, len(places))
        parts.append(f'<text x="{x:.1f}" y="{bottom + 18}" text-anchor="middle">{escape(name)}</text>')
    return "\n".join(parts)


def _line(one: Series, color: str, shift: float, count: int) -> str:
    """Return one series; its line breaks at gaps."""
    path, parts, move = "", [], "M"
    for k, (share, interval) in enumerate(zip(one.shares, one.intervals, strict=True)):
        if share is None:
            move = "M"
            continue
        x = _x(k, count) + shift
        path += f"{move}{x:.1f} {_y(share):.1f}"
        move = "L"
        parts.append(f'<circle cx="{x:.1f}" cy="{_y(share):.1f}" r="3.5" fill="{color}"/>')
        if interval is not None:
            low, high = (_y(edge) for edge in interval)
            parts.append(f'<path d="M{x:.1f} {low:.1f}V{high:.1f}" stroke="{color}" stroke-width="1.5"/>')
    return "\n".join([f'<path d="{path}" fill="none" stroke="{color}" stroke-width="2"/>', *parts])
