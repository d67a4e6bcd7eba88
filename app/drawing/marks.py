"""Histograms, and vertical lines that mark a value on them."""

from __future__ import annotations

import math

import plotly.graph_objects as go

from app.drawing.colors import NEUTRAL, css
from app.drawing.plots import styled_figure
from pipeline.types import FloatArray, IntArray


def mark(
    figure: go.Figure, x: float, label: str, color: str, side: str, dash: str = "solid", log: bool = False
) -> None:
    """Draw a vertical line over the chart's whole height, with a label above it.

    Args:
        figure: the chart.
        x: position in the unit of the axis.
        label: HTML of the label.
        color: CSS colour.
        side: side of the label that is at ``x``: left, center or right, so that labels do not overlap.
        dash: dash style of the line.
        log: whether the axis is logarithmic.
    """
    line = {"color": color, "width": 1.5, "dash": dash}
    figure.add_shape(type="line", x0=x, x1=x, y0=0, y1=1, yref="paper", line=line)
    figure.add_annotation(
        x=math.log10(x) if log else x,  # on a logarithmic axis, annotations take exponents, unlike shapes
        y=1.0,
        yref="paper",
        yanchor="bottom",
        xanchor=side,
        text=label,
        showarrow=False,
        font={"color": color},
    )


def bar_figure(x_title: str, y_title: str) -> go.Figure:
    """Return an empty histogram."""
    return styled_figure(
        margin={"l": 62, "r": 10, "t": 24, "b": 34},
        xaxis={"title": x_title},
        yaxis={"title": y_title, "nticks": 4},
        showlegend=False,
        bargap=0,
        font={"size": 11},
    )


def add_bars(figure: go.Figure, edges: FloatArray, counts: IntArray, unit: str, what: str) -> None:
    """Add bars of (B,) counts of ``what`` between (B + 1,) edges in a unit."""
    figure.add_bar(
        x=0.5 * (edges[1:] + edges[:-1]),
        y=counts,
        width=edges[1] - edges[0],
        marker_color=css(NEUTRAL),
        hovertemplate=f"%{{x:.1f}} {unit}: %{{y}} {what}<extra></extra>",
    )
