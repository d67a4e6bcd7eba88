"""Live curves of a registration race, with the player's place marked."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import viser
from viser import uplot

from app.drawing.colors import NEUTRAL, css
from app.screens.fuse.clock import RaceClock
from pipeline.types import FloatArray

LANE_COLORS = ("#5b6570", "#009e73", "#cc6699", "#7a4a00")
"""Grey, green, pink and brown: of the first to the fourth method."""
LANE_DASHES = ((), (), (7, 3), (2, 3))
CURSOR = css(NEUTRAL)


class Curves:
    """One chart: a value over the iterations, or over the time, of up to four methods."""

    def __init__(self, gui: viser.GuiApi, unit: str, least: float) -> None:
        """Add an empty chart; ``least`` is the smallest height of its axis."""
        nothing = np.full(2, np.nan)
        self._least = least
        self._unit = unit
        self._plot = gui.add_uplot(
            data=(np.array([0.0, 1.0]), *[nothing] * (2 * len(LANE_COLORS) + 1)),
            series=_series(),
            scales=_scales(1.0),
            axes=_axes("iteration", unit),
            legend=uplot.Legend(show=False),
            cursor=uplot.Cursor(show=False),
            padding=(12, 16, 0, 0),
            height=180,
        )
        self._clock = RaceClock((np.array([0.0, 1.0]),), 1, False)
        self._values: list[FloatArray] = [nothing]
        self._top = 1.0

    def load(self, clock: RaceClock, values: Sequence[Sequence[float]]) -> None:
        """Show new curves, one sequence for each lane of the clock."""
        self._clock = clock
        self._values = [np.asarray(curve, dtype=float) for curve in values]
        highest = max(float(np.nanmax(curve, initial=0.0)) for curve in self._values)
        # A fixed range, because uPlot finds none by itself where a curve has gaps.
        self._top = 1.08 * max(highest, self._least)
        self._plot.scales = _scales(self._top)
        self._plot.axes = _axes("time, ms" if clock.in_ms else "iteration", self._unit)
        self.mark(0)

    def mark(self, place: int) -> None:
        """Draw the player's place as a line, and a dot on each curve at the step its lane shows."""
        now = float(place * self._clock.unit)
        # The cursor is two points above each other, so its place stands twice among the abscissae.
        x = np.sort(np.concatenate([np.unique(np.concatenate([*self._clock.xs, [now]])), [now]]))
        cursor = np.full(len(x), np.nan)
        first = int(np.searchsorted(x, now))
        cursor[first : first + 2] = 0.0, self._top
        lanes = list(zip(self._clock.xs, self._values, self._clock.rows(place), strict=True))
        empty = [np.full(len(x), np.nan)] * (len(LANE_COLORS) - len(lanes))
        lines = [_line(x, lane_x, curve) for lane_x, curve, _ in lanes]
        dots = [_dot(x, lane_x[row], curve[row]) for lane_x, curve, row in lanes]
        self._plot.data = (x, cursor, *lines, *empty, *dots, *empty)


def _line(x: FloatArray, lane_x: FloatArray, curve: FloatArray) -> FloatArray:
    """A lane's polyline at the chart's abscissae, nothing beyond its end."""
    if len(curve) == 1:
        return _dot(x, lane_x[0], curve[0])
    return np.interp(x, lane_x, curve, left=np.nan, right=np.nan)


def _dot(x: FloatArray, at: float, value: float) -> FloatArray:
    dot = np.full(len(x), np.nan)
    dot[int(np.searchsorted(x, at))] = value
    return dot


def _scales(top: float) -> dict[str, uplot.Scale]:
    return {"x": uplot.Scale(time=False), "y": uplot.Scale(range=(0.0, top))}


def _axes(x: str, y: str) -> tuple[uplot.Axis, ...]:
    return (uplot.Axis(label=x, labelSize=20, size=34), uplot.Axis(label=y, labelSize=18, size=46))


def _series() -> tuple[uplot.Series, ...]:
    lines = [
        uplot.Series(label=f"lane {index + 1}", stroke=color, width=2, dash=dash)
        for index, (color, dash) in enumerate(zip(LANE_COLORS, LANE_DASHES, strict=True))
    ]
    dots = [
        uplot.Series(
            label="now", stroke=color, width=0, points=uplot.Series_Points(show=True, size=9, fill=color)
        )
        for color in LANE_COLORS
    ]
    return (uplot.Series(label="x"), uplot.Series(label="cursor", stroke=CURSOR, width=1), *lines, *dots)
