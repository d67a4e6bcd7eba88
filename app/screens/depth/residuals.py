"""Histogram of aligned minus sensor depth, with its median and its RMS."""

from __future__ import annotations

import plotly.graph_objects as go

from app.drawing.colors import BRAND, LOSS, NEUTRAL, css
from app.drawing.marks import mark
from app.records import ResidualView


def residual_figure(view: ResidualView | None) -> go.Figure:
    """Bars in centimetres, a line at the median and lines at plus and minus the RMS; None is empty."""
    figure = go.Figure()
    figure.update_layout(
        template="plotly_white",
        margin={"l": 62, "r": 10, "t": 24, "b": 34},
        xaxis={"title": "aligned minus sensor depth, cm"},
        yaxis={"title": "pixels", "nticks": 4},
        showlegend=False,
        bargap=0,
        font={"size": 11},
    )
    if view is None:
        return figure
    edges_cm = 100.0 * view.edges_m
    figure.add_bar(
        x=0.5 * (edges_cm[1:] + edges_cm[:-1]),
        y=view.counts,
        width=edges_cm[1] - edges_cm[0],
        marker_color=css(NEUTRAL),
        hovertemplate="%{x:.1f} cm: %{y} pixels<extra></extra>",
    )
    if view.counts.any():
        mark(figure, 100.0 * view.median_m, "median", css(LOSS), "center")
        if view.rms_m <= view.edges_m[-1]:
            mark(figure, -100.0 * view.rms_m, "−RMS", css(BRAND), "right")
            mark(figure, 100.0 * view.rms_m, "+RMS", css(BRAND), "left")
    return figure
