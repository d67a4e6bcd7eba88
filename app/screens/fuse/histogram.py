"""The pairs of one iteration by distance, with the kernel and the weight that the method gives them."""

from __future__ import annotations

import numpy as np
from viser import uplot

from app.drawing.colors import DELIVERED, INFERRED, NEUTRAL, css
from app.drawing.curves import add_chart, scales
from app.screens.fuse.view import PairHistogram, RaceLane
from app.web.markup import Markup
from app.window.gui import Gui
from pipeline.types import FloatArray

BARS, KERNEL, WEIGHT = css(NEUTRAL), css(DELIVERED), css(INFERRED)


class HistogramChart:
    """Grey bars of counts, the kernel f in green and the weight w in violet, all over their own peaks."""

    def __init__(self, gui: Gui) -> None:
        series = (
            uplot.Series(label="pairs", stroke=BARS, fill=f"{BARS}66", width=1),
            uplot.Series(label="f", stroke=KERNEL, width=2, dash=(7, 3)),
            uplot.Series(label="w", stroke=WEIGHT, width=2),
        )
        self._plot = add_chart(gui, series, ("pair distance, cm", "over its peak"), 190)
        self._caption = gui.add_html(Markup(""))

    def show(self, lane: RaceLane, row: int, edges_m: FloatArray) -> None:
        """Draw the pairs of a lane's step."""
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
    """(B + 1,) f(d) = exp(-d^2 / 2 sigma^2) at the bins' edges; NaN for methods without it."""
    if not (lane.kernel and shown.sigma_m > 0):
        return np.full(len(edges_m), np.nan)
    return np.exp(-0.5 * (edges_m / shown.sigma_m) ** 2)


def weights(shown: PairHistogram) -> FloatArray:
    """(B,) mean weight of a pair in each bin over the largest; between known bins empty ones are bridged,
    beyond the farthest pair nothing weighs."""
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
        parts.append(Markup("<b style='color:{}'>━ weight w = −p log p</b>").format(WEIGHT))
    else:
        parts.append(Markup("<b style='color:{}'>━ weight w</b> (no kernel f)").format(WEIGHT))
    text = Markup(" · ").join(parts)
    return Markup(
        "<div style='padding: 0 0.8em 0.5em; font-size: 12px'>{}. Last bar: all farther pairs.</div>"
    ).format(text)
