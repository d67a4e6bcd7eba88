"""Histogram of aligned minus sensor depth, with its median and its RMS."""

from __future__ import annotations

import plotly.graph_objects as go

from app.compute.records import ResidualView
from app.drawing.colors import BRAND, LOSS, css
from app.drawing.marks import add_bars, bar_figure, mark


def residual_figure(view: ResidualView | None) -> go.Figure:
    """Bars in centimetres, a line at the median and lines at plus and minus the RMS; None is empty."""
    figure = bar_figure("aligned minus sensor depth, cm", "pixels")
    if view is None:
        return figure
    add_bars(figure, 100.0 * view.edges_m, view.counts, "cm", "pixels")
    if view.counts.any():
        mark(figure, 100.0 * view.median_m, "median", css(LOSS), "center")
        if view.rms_m <= view.edges_m[-1]:
            mark(figure, -100.0 * view.rms_m, "−RMS", css(BRAND), "right")
            mark(figure, 100.0 * view.rms_m, "+RMS", css(BRAND), "left")
    return figure
