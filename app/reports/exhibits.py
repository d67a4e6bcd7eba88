"""Tables and pictures of an experiment as HTML, inline SVG and inline PNG."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from app.reports.html import picture, pictures, table
from app.web.markup import Markup
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
_TEXT = Markup('<text x="{:.1f}" y="{:.1f}" text-anchor="{}">{}</text>')
_CURVE = Markup(
    '<polygon points="{band}" fill="{color}" opacity=".13"/>'
    '<polyline points="{line}" fill="none" stroke="{color}" stroke-width="1.8"{dashes}/>'
    '<line x1="{left}" x2="{right}" y1="{y}" y2="{y}" stroke="{color}" stroke-width="2.4"{dashes}/>'
)
_TICK = Markup('<line x1="{}" x2="{}" y1="{:.1f}" y2="{:.1f}" stroke="#8884"/>')
_CELL = Markup('<rect x="{}" y="{}" width="{size}" height="{size}" fill="hsl(204 70% {:.0f}%)"/>')


def exhibit_html(exhibit: Exhibit) -> Markup:
    """Return one table or picture with its title and its note."""
    if isinstance(exhibit, Table):
        kind, body = "wide", table(exhibit.header, exhibit.rows)
    elif isinstance(exhibit, Chart):
        kind, body = "picture", chart_svg(exhibit)
    elif isinstance(exhibit, Picture):
        kind, body = "wide", _images(exhibit)
    else:
        kind, body = "picture", heat_map_svg(exhibit)
    note = Markup('<p class="note">{}</p>').format(exhibit.note) if exhibit.note else ""
    return Markup('<div class="{}"><h3>{}</h3>{}{}</div>').format(kind, exhibit.title, body, note)


def _images(exhibit: Picture) -> Markup:
    """Return the images as lossless PNG, so that rays without a surface keep their one colour."""
    figures = [picture(rgb, caption, "png") for caption, rgb in exhibit.images]
    return pictures(figures, min(PICTURES_IN_A_ROW, len(figures)))


@dataclass(frozen=True, slots=True)
class Axis:
    """An axis between two values, linear or logarithmic."""

    low: float
    high: float
    logarithmic: bool

    def share(self, value: float) -> float:
        """Return the position of a value: 0 at the low end, 1 at the high one."""
        if self.logarithmic:
            return float(np.log(value / self.low) / np.log(self.high / self.low))
        return (value - self.low) / (self.high - self.low)

    def ticks(self) -> list[tuple[float, str]]:
        """Return round values with their texts."""
        if self.logarithmic:
            return [(value, f"{value:,g}" if value < 1e6 else f"{value:,.0f}") for value in self._powers()]
        return [(value, f"{value:g}") for value in ticks(self.high)]

    def _powers(self) -> list[float]:
        """Return powers of ten, with twos and fives between them if there are few."""
        decades = range(int(np.floor(np.log10(self.low))), int(np.ceil(np.log10(self.high))) + 1)
        for digits in ((1,), (1, 2, 5)):
            values = [digit * 10.0**decade for decade in decades for digit in digits]
            values = [value for value in values if self.low <= value <= self.high]
            if len(values) >= 3:
                break
        return values


def chart_axes(chart: Chart) -> tuple[Axis, Axis]:
    """Return the horizontal and the vertical axis; linear ones start at zero."""
    x_high = max((curve.x[-1] for curve in chart.curves), default=1.0)
    y_high = 1.05 * max((max(curve.high) for curve in chart.curves), default=1.0) or 1.0
    x_low = y_low = 0.0
    if chart.logarithmic:
        x_low = min(curve.x[0] for curve in chart.curves)
        y_low = min(min(curve.low) for curve in chart.curves) / 1.2
    return Axis(x_low, x_high, chart.logarithmic), Axis(y_low, y_high, chart.logarithmic)


def chart_svg(chart: Chart) -> Markup:
    """Draw lines with bands."""
    x_axis, y_axis = chart_axes(chart)
    width, height = WIDTH - LEFT - RIGHT, HEIGHT - TOP - BOTTOM

    def at(x: Sequence[float], y: Sequence[float]) -> list[str]:
        return [
            f"{LEFT + width * x_axis.share(a):.1f},{TOP + height * (1.0 - y_axis.share(b)):.1f}"
            for a, b in zip(x, y, strict=True)
        ]

    parts = [_axes(chart, x_axis, y_axis)]
    for row, curve in enumerate(chart.curves):
        y = TOP + 14 + 17 * row
        parts += [
            _CURVE.format(
                band=" ".join(at(curve.x, curve.high) + at(curve.x, curve.low)[::-1]),
                line=" ".join(at(curve.x, curve.y)),
                color=COLORS[row % len(COLORS)],
                dashes=_dashes(curve),
                left=WIDTH - RIGHT + 10,
                right=WIDTH - RIGHT + 30,
                y=y - 4,
            ),
            _TEXT.format(WIDTH - RIGHT + 36, y, "start", curve.label),
        ]
    return _svg(WIDTH, HEIGHT, chart.title, parts)


def heat_map_svg(heat_map: HeatMap) -> Markup:
    """Draw cells from pale (0 %) to blue (100 %), each with its share as text."""
    columns, rows = len(heat_map.x), len(heat_map.y)
    width, height = LEFT + CELL_PX * columns + 10, TOP + CELL_PX * rows + BOTTOM
    parts = []
    for i, shares in enumerate(heat_map.shares):
        y = TOP + CELL_PX * i
        parts.append(_TEXT.format(LEFT - 8, y + CELL_PX / 2 + 4, "end", f"{heat_map.y[i]:g}"))
        for j, share in enumerate(shares):
            x = LEFT + CELL_PX * j
            cell = _CELL.format(x, y, 94 - 38 * share, size=CELL_PX - 2)
            number = _TEXT.format(x + CELL_PX / 2, y + CELL_PX / 2 + 4, "middle", f"{share:.0%}")
            parts += [cell, Markup('<g fill="#111">{}</g>').format(number)]
    for j, value in enumerate(heat_map.x):
        below = TOP + CELL_PX * rows + 15
        parts.append(_TEXT.format(LEFT + CELL_PX * (j + 0.5), below, "middle", f"{value:g}"))
    at = LEFT + CELL_PX * columns / 2, height - 10, TOP + CELL_PX * rows / 2
    return _svg(width, height, heat_map.title, [*parts, _labels(heat_map, *at)])


def _axes(chart: Chart, x_axis: Axis, y_axis: Axis) -> Markup:
    width, height = WIDTH - LEFT - RIGHT, HEIGHT - TOP - BOTTOM
    parts = []
    for value, text in y_axis.ticks():
        y = TOP + height * (1.0 - y_axis.share(value))
        parts += [_TICK.format(LEFT, LEFT + width, y, y), _TEXT.format(LEFT - 6, y + 4, "end", text)]
    for value, text in x_axis.ticks():
        parts.append(_TEXT.format(LEFT + width * x_axis.share(value), TOP + height + 16, "middle", text))
    return Markup("").join([*parts, _labels(chart, LEFT + width / 2, HEIGHT - 8, TOP + height / 2)])


def _labels(exhibit: Chart | HeatMap, x: float, below: float, middle: float) -> Markup:
    """Return the axis labels: below the chart at ``x``, and upwards along the left edge."""
    return Markup('{}<g transform="translate(14 {}) rotate(-90)">{}</g>').format(
        _TEXT.format(x, below, "middle", exhibit.x_label),
        middle,
        _TEXT.format(0, 0, "middle", exhibit.y_label),
    )


def ticks(high: float, most: int = 6) -> list[float]:
    """Return round values from zero to at most ``high`` (above 0), in at most ``most`` equal steps."""
    power = 10.0 ** np.floor(np.log10(high / most))
    step = next(power * factor for factor in (1, 2, 5, 10) if high / (power * factor) <= most)
    return [round(step * k, 10) for k in range(int(high / step + 1e-9) + 1)]


def _dashes(curve: Curve) -> Markup:
    """Return the attribute that dashes the curves of the plane metric; empty for other curves."""
    return Markup(' stroke-dasharray="6 3"') if curve.label.endswith("plane") else Markup("")


def _svg(width: float, height: float, title: str, parts: Sequence[Markup]) -> Markup:
    return Markup(
        '<svg class="chart" role="img" aria-label="{title}" viewBox="0 0 {width} {height}" '
        'width="{width}" height="{height}" fill="currentColor" font-size="12">{body}</svg>'
    ).format(title=title, width=width, height=height, body=Markup("").join(parts))
