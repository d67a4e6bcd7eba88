"""Live curves of a registration race, with the player's iteration marked."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import viser
from viser import uplot

from app.jobs.records import RaceLane
from pipeline.types import FloatArray

LANE_COLORS = ("#5b6570", "#009e73")
LANE_NAMES = ("grey", "green")
"""Of the first and the second method."""


class Curves:
    """One chart: a value in centimetres over the iterations of two methods."""

    def __init__(self, gui: viser.GuiApi, title: str) -> None:
        nothing = np.array([0.0, 1.0])
        self._plot = gui.add_uplot(
            data=(nothing, *(np.full(2, np.nan),) * 4),
            series=_series(("first", "second")),
            title=title,
            scales={"x": uplot.Scale(time=False), "y": uplot.Scale(range=(0.0, 1.0))},
            axes=(
                uplot.Axis(label="iteration", labelSize=20, size=34),
                uplot.Axis(label="cm", labelSize=18, size=46),
            ),
            legend=uplot.Legend(show=False),
            height=170,
        )
        self._title = title
        self._values: list[FloatArray] = [np.full(2, np.nan)] * 2

    @property
    def visible(self) -> bool:
        """Whether the chart is shown."""
        return self._plot.visible

    @visible.setter
    def visible(self, visible: bool) -> None:
        self._plot.visible = visible

    def load(self, lanes: Sequence[RaceLane], values: Sequence[Sequence[float | None]]) -> None:
        """Show new curves, one sequence of metres for each lane."""
        length = max(2, *(len(lane.steps) for lane in lanes))
        self._values = [_padded(curve, length) for curve in values]
        labels = [lane.label for lane in lanes]
        self._plot.series = _series(labels)
        self._plot.title = f"{self._title} · {LANE_NAMES[0]}: {labels[0]}, {LANE_NAMES[1]}: {labels[1]}"
        # A fixed range, because uPlot finds none by itself where a curve has gaps.
        highest = float(np.nanmax([*(np.nanmax(v, initial=0.0) for v in self._values), 0.1]))
        self._plot.scales = {
            "x": uplot.Scale(time=False),
            "y": uplot.Scale(range=(0.0, 1.08 * highest)),
        }
        self.mark(0)

    def mark(self, position: int) -> None:
        """Put a dot on each curve at the player's position, or at its end if it ended before."""
        x = np.arange(len(self._values[0]), dtype=float)
        dots = []
        for curve in self._values:
            dot = np.full(len(curve), np.nan)
            known = np.flatnonzero(np.isfinite(curve[: position + 1]))
            if len(known):
                dot[known[-1]] = curve[known[-1]]
            dots.append(dot)
        self._plot.data = (x, *self._values, *dots)


def _padded(curve: Sequence[float | None], length: int) -> FloatArray:
    values = np.full(length, np.nan)
    values[: len(curve)] = [np.nan if value is None else 100.0 * value for value in curve]
    return values


def _series(labels: Sequence[str]) -> tuple[uplot.Series, ...]:
    lines = [
        uplot.Series(label=label, stroke=color, width=2)
        for label, color in zip(labels, LANE_COLORS, strict=True)
    ]
    dots = [
        uplot.Series(
            label="now", stroke=color, width=0, points=uplot.Series_Points(show=True, size=9, fill=color)
        )
        for color in LANE_COLORS
    ]
    return (uplot.Series(label="iteration"), *lines, *dots)
