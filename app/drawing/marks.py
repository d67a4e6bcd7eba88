"""Lines that mark a value on a chart."""

from __future__ import annotations

import plotly.graph_objects as go


def mark(figure: go.Figure, x: float, label: str, color: str, side: str) -> None:
    """A line over the whole height; the labels stand above it, on sides where they do not meet.

    Args:
        figure: the chart.
        x: where, in the unit of its axis.
        label: HTML.
        color: CSS.
        side: of the label that is at ``x``: left, center or right.
    """
    figure.add_shape(type="line", x0=x, x1=x, y0=0, y1=1, yref="paper", line={"color": color, "width": 1.5})
    figure.add_annotation(
        x=x,
        y=1.0,
        yref="paper",
        yanchor="bottom",
        xanchor=side,
        text=label,
        showarrow=False,
        font={"color": color},
    )
