"""Charts that are redrawn many times a second: curves over a common axis, up to the player's time."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import viser
from viser import uplot

from app.drawing.colors import NEUTRAL, css
from pipeline.types import FloatArray

HEADROOM = 1.08
"""Height of the axis over the highest value."""


def add_chart(
    gui: viser.GuiApi, series: Sequence[uplot.Series], labels: tuple[str, str], height_px: int
) -> viser.GuiUplotHandle:
    """Add an empty chart of these series; ``labels`` are those of the x and the y axis."""
    return gui.add_uplot(
        data=(np.array([0.0, 1.0]), *[np.full(2, np.nan)] * len(series)),
        series=(uplot.Series(label="x"), *series),
        scales=scales((0.0, 1.0), 1.0),
        axes=axes(*labels),
        legend=uplot.Legend(show=False),
        cursor=uplot.Cursor(show=False),
        padding=(12, 16, 0, 0),
        height=height_px,
    )


def scales(ends: tuple[float, float], top: float) -> dict[str, uplot.Scale]:
    """Return fixed ranges: uPlot finds none where a curve has gaps."""
    return {"x": uplot.Scale(time=False, range=ends), "y": uplot.Scale(range=(0.0, HEADROOM * top))}


def axes(x: str, y: str) -> tuple[uplot.Axis, ...]:
    """Return both axes with their labels."""
    return (uplot.Axis(label=x, labelSize=20, size=34), uplot.Axis(label=y, labelSize=18, size=50))


class Curves:
    """A chart of one quantity for several objects, each in its own colour."""

    def __init__(
        self,
        gui: viser.GuiApi,
        quantity: str,
        most: int,
        least: float = 0.0,
        height_px: int = 180,
    ) -> None:
        """Add an empty chart.

        Args:
            gui: panel to add it to.
            quantity: label of the vertical axis, with the unit.
            most: largest number of curves.
            least: smallest height of the vertical axis.
            height_px: height of the chart.
        """
        self._quantity, self._least, self._most = quantity, least, most
        self._plot = add_chart(gui, _series([css(NEUTRAL)] * most), ("", quantity), height_px)
        self._curves: Sequence[tuple[FloatArray, FloatArray]] = ()
        self._top = 1.0

    def load(
        self,
        curves: Sequence[tuple[FloatArray, FloatArray]],
        colors: Sequence[str],
        ends: tuple[float, float],
        label: str,
    ) -> None:
        """Show other curves.

        Args:
            curves: (K,) ascending abscissae and (K,) values of each curve, NaN where there is none.
            colors: colours of the curves.
            ends: ends of the horizontal axis.
            label: label of the horizontal axis.
        """
        self._curves = curves
        highest = max((float(np.nanmax(values, initial=0.0)) for _, values in curves), default=0.0)
        self._top = max(highest, self._least) or 1.0
        missing = self._most - len(colors)
        self._plot.series = (uplot.Series(label="x"), *_series([*colors, *[css(NEUTRAL)] * missing]))
        self._plot.scales = scales(ends, self._top)
        self._plot.axes = axes(label, self._quantity)
        self.mark(ends[0])

    def mark(self, now: float, rows: Sequence[int] = ()) -> None:
        """Draw the player's time as a line, and each curve up to its index in ``rows``, with a dot there."""
        # The vertical line has two points with the same abscissa, so the player's time is in ``x`` twice.
        own = np.concatenate([[now], *(at for at, _ in self._curves)])
        x = np.sort(np.append(np.unique(own), now))
        cursor = np.full(len(x), np.nan)
        first = int(np.searchsorted(x, now))
        cursor[first : first + 2] = 0.0, HEADROOM * self._top
        empty = np.full(len(x), np.nan)
        known = zip(self._curves, rows, strict=False)
        lines = [polyline(x, at[: row + 1], values[: row + 1]) for (at, values), row in known]
        dots = [_dot(x, at[row], values[row]) for (at, values), row in zip(self._curves, rows, strict=False)]
        padded = [[*some, *[empty] * (self._most - len(some))] for some in (lines, dots)]
        self._plot.data = (x, cursor, *padded[0], *padded[1])


def _series(colors: Sequence[str]) -> tuple[uplot.Series, ...]:
    """Return the series: the player's time, a line for each curve, and a dot for each."""
    lines = [uplot.Series(label="curve", stroke=color, width=2) for color in colors]
    dots = [
        uplot.Series(
            label="now", stroke=color, width=0, points=uplot.Series_Points(show=True, size=9, fill=color)
        )
        for color in colors
    ]
    return (uplot.Series(label="cursor", stroke=css(NEUTRAL), width=1), *lines, *dots)


def polyline(x: FloatArray, at: FloatArray, values: FloatArray) -> FloatArray:
    """Return (X,) values of a curve at a chart's (X,) abscissae: linear over gaps, NaN beyond its ends.

    Args:
        x: the chart's abscissae.
        at: (K,) ascending abscissae of the curve.
        values: (K,) values of the curve, NaN in its gaps.
    """
    known = np.isfinite(values)
    if not known.any():
        return np.full(len(x), np.nan)
    return np.interp(x, at[known], values[known], left=np.nan, right=np.nan)


def _dot(x: FloatArray, at: float, value: float) -> FloatArray:
    dot = np.full(len(x), np.nan)
    dot[int(np.searchsorted(x, at))] = value
    return dot
