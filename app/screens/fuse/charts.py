"""The race in charts: the pairs by distance, and RMSE and entropy as far as the race has come."""

from __future__ import annotations

import numpy as np

from app.drawing.colors import css
from app.drawing.curves import Curves
from app.screens.fuse.clock import RaceClock
from app.screens.fuse.histogram import HistogramChart
from app.screens.fuse.labels import MARKS, MOST_LANES
from app.screens.fuse.methods import color_of
from app.screens.fuse.view import RaceView
from app.web.markup import Markdown, Markup
from app.window.ui import Ui

FIRST = f"{MARKS[0]} first"


class RaceCharts:
    """Three charts in tabs, all with the player's place marked."""

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
        """Show another race, or the same by another clock."""
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
        """Count the pairs of another lane."""
        self._lane.value = self._lane.options[min(index, len(self._lane.options) - 1)]
        self._show_pairs()

    def mark(self, now: float, rows: tuple[int, ...]) -> None:
        """Follow the player: the place on the axis, and the step of each lane."""
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
    """The lanes with the colours of their curves."""
    names = Markup(" &emsp; ").join(
        Markup("<b style='color:{}; white-space: nowrap'>{} {}</b>").format(
            css(color_of(lane.rival)), mark, lane.label
        )
        for mark, lane in zip(MARKS, view.lanes, strict=False)
    )
    return Markup("<div style='padding: 0 0.8em 0.5em; font-size: 13px'>{}</div>").format(names)
