"""Charts of a race: the pairs by distance, and RMSE and entropy up to the player's time."""

from __future__ import annotations

import numpy as np
from viser import uplot

from app.drawing.colors import DELIVERED, INFERRED, NEUTRAL, css
from app.drawing.curves import Curves, add_chart, scales
from app.screens.fuse.clock import RaceClock
from app.screens.fuse.labels import MARKS, MOST_LANES
from app.screens.fuse.methods import color_of
from app.screens.fuse.view import PairHistogram, RaceLane, RaceView
from app.web.markup import Markdown, Markup
from app.window.gui import Gui
from app.window.ui import Ui
from pipeline.types import FloatArray

FIRST = f"{MARKS[0]} first"


class RaceCharts:
    """Three charts in tabs, each with the player's time marked."""

    def __init__(self, ui: Ui) -> None:
        gui = ui.gui
        self._view: RaceView | None = None
        self._rows: tuple[int, ...] = ()
        tabs = gui.add_tab_group()
        with tabs.add_tab("Pairs"):
            self._lane = gui.add_dropdown("Lane", [FIRST], hint="Method whose pairs are counted.")
            ui.when_changed(self._lane, self._show_pairs)
            self._pairs = HistogramChart(gui)
        with tabs.add_tab("RMSE"):
            self._rmse = Curves(gui, "RMSE, cm", MOST_LANES, 0.1)
        with tabs.add_tab("Entropy"):
            self._entropy = Curves(gui, "entropy, nat", MOST_LANES, 1.0)
            self._without = gui.add_markdown(Markdown("None of these methods has an entropy."), visible=False)
        self._legend = gui.add_html(Markup(""))

    def load(self, view: RaceView, clock: RaceClock) -> None:
        """Show another race, or the same race with another clock."""
        self._view = view
        lanes = view.lanes
        colors = [css(color_of(lane.rival)) for lane in lanes]
        entropies = [np.array([step.entropy_nat for step in lane.steps]) for lane in lanes]
        rmses = [np.array([100.0 * step.rmse_m for step in lane.steps]) for lane in lanes]
        at = [clock.shown(steps_ns) for steps_ns in clock.steps_ns]
        ends = (0.0, max(float(x[-1]) for x in at) or 1.0)
        for chart, values in ((self._rmse, rmses), (self._entropy, entropies)):
            chart.load(list(zip(at, values, strict=True)), colors, ends, clock.label)
        self._without.visible = not np.isfinite(np.concatenate(entropies)).any()
        names = tuple(f"{MARKS[index]} {lane.label}" for index, lane in enumerate(lanes))
        if names != tuple(self._lane.options):
            kept = self._index()
            self._lane.options = names
            self._lane.value = names[min(kept, len(names) - 1)]
        self._legend.content = legend(view)

    def choose_lane(self, index: int) -> None:
        """Show the pairs of another lane."""
        self._lane.value = self._lane.options[min(index, len(self._lane.options) - 1)]
        self._show_pairs()

    def mark(self, now: float, rows: tuple[int, ...]) -> None:
        """Follow the player: its place on the axis, and the step of each lane."""
        self._rows = rows
        for curves in (self._rmse, self._entropy):
            curves.mark(now, rows)
        self._show_pairs()

    def _index(self) -> int:
        return self._lane.options.index(self._lane.value)

    def _show_pairs(self) -> None:
        if self._view is not None and self._rows:
            index = self._index()
            self._pairs.show(self._view.lanes[index], self._rows[index], self._view.edges_m)


def legend(view: RaceView) -> Markup:
    """Return HTML of the lanes' names in the colours of their curves."""
    names = Markup(" &emsp; ").join(
        Markup("<b style='color:{}; white-space: nowrap'>{} {}</b>").format(
            css(color_of(lane.rival)), mark, lane.label
        )
        for mark, lane in zip(MARKS, view.lanes, strict=False)
    )
    return Markup("<div style='padding: 0 0.8em 0.5em; font-size: 13px'>{}</div>").format(names)


BARS, KERNEL, WEIGHT = css(NEUTRAL), css(DELIVERED), css(INFERRED)


class HistogramChart:
    """Grey bars of counts, kernel f in green and weight w in violet, each scaled to its own peak."""

    def __init__(self, gui: Gui) -> None:
        series = (
            uplot.Series(label="pairs", stroke=BARS, fill=f"{BARS}66", width=1),
            uplot.Series(label="f", stroke=KERNEL, width=2, dash=(7, 3)),
            uplot.Series(label="w", stroke=WEIGHT, width=2),
        )
        self._plot = add_chart(gui, series, ("pair distance, cm", "over its peak"), 190)
        self._caption = gui.add_html(Markup(""))

    def show(self, lane: RaceLane, row: int, edges_m: FloatArray) -> None:
        """Draw the pairs of one step of a lane in the bins between (B + 1,) edges."""
        shown = lane.steps[row].histogram
        most = max(1, *(int(step.histogram.counts.max()) for step in lane.steps))
        edges_cm = 100.0 * edges_m
        self._plot.scales = scales((float(edges_cm[0]), float(edges_cm[-1])), 1.0)
        self._plot.data = (
            np.repeat(edges_cm, 2)[1:-1],
            np.repeat(shown.counts / most, 2),
            np.repeat(kernel(lane, shown, edges_m), 2)[1:-1],
            np.repeat(weights(shown), 2),
        )
        self._caption.content = _caption(lane, shown)


def kernel(lane: RaceLane, shown: PairHistogram, edges_m: FloatArray) -> FloatArray:
    """Return (B + 1,) f(d) = exp(-d^2 / 2 sigma^2) at the bins' edges; NaN for methods without it."""
    if not (lane.kernel and shown.sigma_m > 0):
        return np.full(len(edges_m), np.nan)
    return np.exp(-0.5 * (edges_m / shown.sigma_m) ** 2)


def weights(shown: PairHistogram) -> FloatArray:
    """Return (B,) mean weights of the bins as parts of the largest one, interpolated over empty bins; zero
    beyond the farthest pair, and NaN if no bin has pairs."""
    known = np.flatnonzero(np.isfinite(shown.weights))
    if not len(known):
        return shown.weights
    bins = np.arange(len(shown.weights))
    return np.interp(bins, known, shown.weights[known], right=0.0)


def _caption(lane: RaceLane, shown: PairHistogram) -> Markup:
    parts = [Markup("<b style='color:{}'>▮ pairs</b> ({:,})").format(BARS, int(shown.counts.sum()))]
    if lane.kernel:
        parts.append(
            Markup("<b style='color:{}'>┅ kernel f</b>, σ = {:.1f} cm").format(KERNEL, 100 * shown.sigma_m)
        )
        normals = ", p also with the normals" if lane.rival == ("ceicp-a", "plane") else ""
        parts.append(Markup("<b style='color:{}'>━ weight w = −p log p</b>{}").format(WEIGHT, normals))
    else:
        parts.append(Markup("<b style='color:{}'>━ weight w</b> (no kernel f)").format(WEIGHT))
    text = Markup(" · ").join(parts)
    return Markup(
        "<div style='padding: 0 0.8em 0.5em; font-size: 12px'>{}. Last bar: all farther pairs.</div>"
    ).format(text)
