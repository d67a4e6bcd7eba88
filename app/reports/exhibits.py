"""Tables and pictures of an experiment as HTML, inline SVG and inline PNG."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from html import escape

import numpy as np

from app.reports.html import picture, pictures, table
from lab.claims.exhibits import Chart, Curve, Exhibit, HeatMap, Picture, Table

COLORS = (
    "#5b6570",
    "#cc79a7",
    "#e69f00",
    "#b8860b",
    "#0072b2",
    "#56b4e9",
    "#8a2be2",
    "#009e73",
    "#d55e00",
    "#111111",
)
WIDTH, HEIGHT = 560, 330
LEFT, TOP, RIGHT, BOTTOM = 52, 12, 150, 44
CELL_PX = 54
PICTURES_IN_A_ROW = 3


def exhibit_html(exhibit: Exhibit) -> str:
    """One table or picture with its title and its note."""
    if isinstance(exhibit, Table):
        kind, body = "wide", table(exhibit.header, exhibit.rows)
    elif isinstance(exhibit, Chart):
        kind, body = "picture", chart_svg(exhibit)
    elif isinstance(exhibit, Picture):
        kind, body = "wide", _images(exhibit)
    else:
        kind, body = "picture", heat_map_svg(exhibit)
    note = f'<p class="note">{escape(exhibit.note)}</p>' if exhibit.note else ""
    return f'<div class="{kind}"><h3>{escape(exhibit.title)}</h3>{body}{note}</div>'


def _images(exhibit: Picture) -> str:
    """As PNG, which loses nothing, so that rays without a surface keep their one colour."""
    figures = [picture(rgb, caption, "png") for caption, rgb in exhibit.images]
    return pictures(figures, min(PICTURES_IN_A_ROW, len(figures)))


@dataclass(frozen=True, slots=True)
class Axis:
    """From one value to another, evenly or by powers of ten."""

    low: float
    high: float
    logarithmic: bool

    def share(self, value: float) -> float:
        """Where a value lies: 0 at the low end, 1 at the high one."""
        if self.logarithmic:
            return float(np.log(value / self.low) / np.log(self.high / self.low))
        return (value - self.low) / (self.high - self.low)

    def ticks(self) -> list[tuple[float, str]]:
        """Round values with their texts."""
        if self.logarithmic:
            return [(value, f"{value:,g}" if value < 1e6 else f"{value:,.0f}") for value in self._powers()]
        return [(value, f"{value:g}") for value in ticks(self.high)]

    def _powers(self) -> list[float]:
        """Powers of ten, with twos and fives between where they are few."""
        decades = range(int(np.floor(np.log10(self.low))), int(np.ceil(np.log10(self.high))) + 1)
        for digits in ((1,), (1, 2, 5)):
            values = [digit * 10.0**decade for decade in decades for digit in digits]
            values = [value for value in values if self.low <= value <= self.high]
            if len(values) >= 3:
                break
        return values


def chart_axes(chart: Chart) -> tuple[Axis, Axis]:
    """The horizontal and the vertical axis; those that are not logarithmic begin at zero."""
    x_high = max((curve.x[-1] for curve in chart.curves), default=1.0)
    y_high = 1.05 * max((max(curve.high) for curve in chart.curves), default=1.0) or 1.0
    x_low = y_low = 0.0
    if chart.logarithmic:
        x_low = min(curve.x[0] for curve in chart.curves)
        y_low = min(min(curve.low) for curve in chart.curves) / 1.2
    return Axis(x_low, x_high, chart.logarithmic), Axis(y_low, y_high, chart.logarithmic)


def chart_svg(chart: Chart) -> str:
    """Lines with bands."""
    x_axis, y_axis = chart_axes(chart)
    width, height = WIDTH - LEFT - RIGHT, HEIGHT - TOP - BOTTOM

    def at(x: Sequence[float], y: Sequence[float]) -> list[str]:
        return [
            f"{LEFT + width * x_axis.share(a):.1f},{TOP + height * (1.0 - y_axis.share(b)):.1f}"
            for a, b in zip(x, y, strict=True)
        ]

    parts = [_axes(chart, x_axis, y_axis)]
    for row, curve in enumerate(chart.curves):
        color = COLORS[row % len(COLORS)]
        band = at(curve.x, curve.high) + at(curve.x, curve.low)[::-1]
        y = TOP + 14 + 17 * row
        parts.append(
            f'<polygon points="{" ".join(band)}" fill="{color}" opacity=".13"/>'
            f'<polyline points="{" ".join(at(curve.x, curve.y))}" fill="none" stroke="{color}" '
            f'stroke-width="1.8"{_dashes(curve)}/>'
            f'<line x1="{WIDTH - RIGHT + 10}" x2="{WIDTH - RIGHT + 30}" y1="{y - 4}" y2="{y - 4}" '
            f'stroke="{color}" stroke-width="2.4"{_dashes(curve)}/>'
            f'<text x="{WIDTH - RIGHT + 36}" y="{y}">{escape(curve.label)}</text>'
        )
    return _svg(WIDTH, HEIGHT, chart.title, "".join(parts))


def heat_map_svg(heat_map: HeatMap) -> str:
    """Cells from pale (none) to blue (all), each with its share."""
    columns, rows = len(heat_map.x), len(heat_map.y)
    width, height = LEFT + CELL_PX * columns + 10, TOP + CELL_PX * rows + BOTTOM
    parts = []
    for i, shares in enumerate(heat_map.shares):
        y = TOP + CELL_PX * i
        parts.append(
            f'<text x="{LEFT - 8}" y="{y + CELL_PX / 2 + 4}" text-anchor="end">{heat_map.y[i]:g}</text>'
        )
        for j, share in enumerate(shares):
            x = LEFT + CELL_PX * j
            parts.append(
                f'<rect x="{x}" y="{y}" width="{CELL_PX - 2}" height="{CELL_PX - 2}" '
                f'fill="hsl(204 70% {94 - 38 * share:.0f}%)"/>'
                f'<text x="{x + CELL_PX / 2}" y="{y + CELL_PX / 2 + 4}" text-anchor="middle" fill="#111">'
                f"{share:.0%}</text>"
            )
    for j, value in enumerate(heat_map.x):
        center = LEFT + CELL_PX * (j + 0.5)
        below = TOP + CELL_PX * rows + 15
        parts.append(f'<text x="{center}" y="{below}" text-anchor="middle">{value:g}</text>')
    middle = LEFT + CELL_PX * columns / 2
    parts.append(
        f'<text x="{middle}" y="{height - 10}" text-anchor="middle">{escape(heat_map.x_label)}</text>'
        f'<text transform="translate(14 {TOP + CELL_PX * rows / 2}) rotate(-90)" text-anchor="middle">'
        f"{escape(heat_map.y_label)}</text>"
    )
    return _svg(width, height, heat_map.title, "".join(parts))


def _axes(chart: Chart, x_axis: Axis, y_axis: Axis) -> str:
    width, height = WIDTH - LEFT - RIGHT, HEIGHT - TOP - BOTTOM
    parts = []
    for value, text in y_axis.ticks():
        y = TOP + height * (1.0 - y_axis.share(value))
        parts.append(
            f'<line x1="{LEFT}" x2="{LEFT + width}" y1="{y:.1f}" y2="{y:.1f}" stroke="#8884"/>'
            f'<text x="{LEFT - 6}" y="{y + 4:.1f}" text-anchor="end">{text}</text>'
        )
    for value, text in x_axis.ticks():
        x = LEFT + width * x_axis.share(value)
        parts.append(f'<text x="{x:.1f}" y="{TOP + height + 16}" text-anchor="middle">{text}</text>')
    parts.append(
        f'<text x="{LEFT + width / 2}" y="{HEIGHT - 8}" text-anchor="middle">{escape(chart.x_label)}</text>'
        f'<text transform="translate(14 {TOP + height / 2}) rotate(-90)" text-anchor="middle">'
        f"{escape(chart.y_label)}</text>"
    )
    return "".join(parts)


def ticks(high: float, most: int = 6) -> list[float]:
    """Round values from zero to at most ``high``."""
    power = 10.0 ** np.floor(np.log10(high / most))
    step = next(power * factor for factor in (1, 2, 5, 10) if high / (power * factor) <= most)
    return [round(step * k, 10) for k in range(int(high / step + 1e-9) + 1)]


def _dashes(curve: Curve) -> str:
    return ' stroke-dasharray="6 3"' if curve.label.endswith("plane") else ""


def _svg(width: float, height: float, title: str, body: str) -> str:
    return (
        f'<svg class="chart" role="img" aria-label="{escape(title)}" viewBox="0 0 {width} {height}" '
        f'width="{width}" height="{height}" fill="currentColor" font-size="12">{body}</svg>'
    )
