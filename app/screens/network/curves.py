"""Curves of one or two networks over the simulated time, with the player's place marked."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import viser
from viser import uplot

from app.drawing.colors import NEUTRAL, SOURCE, TARGET, css
from app.screens.network.view import Series
from pipeline.types import FloatArray

RUN_COLORS = (css(TARGET), css(SOURCE))
RUN_DASHES = ((), (7, 3))


class NetworkCurves:
    """One chart: a quantity of up to two runs."""

    def __init__(self, gui: viser.GuiApi, unit: str, top: float) -> None:
        """Add an empty chart.

        Args:
            gui: where to add it.
            unit: quantity and unit of its axis.
            top: of the axis; 0 takes the highest value.
        """
        self._fixed = top
        self._top = 1.0
        self._series: Sequence[Series] = ()
        nothing = np.full(2, np.nan)
        self._plot = gui.add_uplot(
            data=(np.array([0.0, 1.0]), *[nothing] * 3),
            series=(
                uplot.Series(label="t"),
                uplot.Series(label="now", stroke=css(NEUTRAL), width=1),
                *(
                    uplot.Series(label=f"run {index + 1}", stroke=color, width=2, dash=dash)
                    for index, (color, dash) in enumerate(zip(RUN_COLORS, RUN_DASHES, strict=True))
                ),
            ),
            scales=self._scales(0.0, 1.0),
            axes=(
                uplot.Axis(label="simulated time, s", labelSize=20, size=34),
                uplot.Axis(label=unit, labelSize=18, size=52),
            ),
            legend=uplot.Legend(show=False),
            cursor=uplot.Cursor(show=False),
            padding=(12, 16, 0, 0),
            height=170,
        )

    def load(self, series: Sequence[Series], start_s: float, end_s: float) -> None:
        """Show other curves, one for each run."""
        self._series = series
        highest = max((float(np.nanmax(one.values, initial=0.0)) for one in series), default=0.0)
        self._top = 1.05 * (self._fixed or highest or 1.0)
        self._plot.scales = self._scales(start_s, end_s)
        self.mark(start_s)

    def mark(self, now_s: float) -> None:
        """Draw the player's place as a line."""
        # The line is two points above each other, so its place stands twice among the abscissae.
        own = [one.t_s for one in self._series]
        x = np.sort(np.concatenate([np.unique(np.concatenate([*own, [now_s]])), [now_s]]))
        cursor = np.full(len(x), np.nan)
        first = int(np.searchsorted(x, now_s))
        cursor[first : first + 2] = 0.0, self._top
        lines = [polyline(x, one) for one in self._series]
        empty = [np.full(len(x), np.nan)] * (len(RUN_COLORS) - len(lines))
        self._plot.data = (x, cursor, *lines, *empty)

    def _scales(self, start_s: float, end_s: float) -> dict[str, uplot.Scale]:
        return {
            "x": uplot.Scale(time=False, range=(start_s, end_s)),
            "y": uplot.Scale(range=(0.0, self._top)),
        }


def polyline(x: FloatArray, series: Series) -> FloatArray:
    """The curve at a chart's abscissae, straight over gaps, nothing beyond its ends."""
    known = np.isfinite(series.values)
    if not known.any():
        return np.full(len(x), np.nan)
    return np.interp(x, series.t_s[known], series.values[known], left=np.nan, right=np.nan)
