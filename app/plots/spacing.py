"""Histogram of the distance to the nearest neighbour, with the radii that matter drawn in."""

from __future__ import annotations

from collections.abc import Sequence

import plotly.graph_objects as go

from app.drawing.colors import DELIVERED, LOSS, NEUTRAL, SOURCE, css
from app.jobs.records import SpacingView


def spacing_figure(view: SpacingView | None, radii_m: Sequence[float] = ()) -> go.Figure:
    """Bars in millimetres; lines at r_F, r_F + sigma_D and the radii in use."""
    figure = go.Figure()
    if view is not None:
        edges_mm = 1000.0 * view.edges_m
        figure.add_bar(
            x=0.5 * (edges_mm[1:] + edges_mm[:-1]),
            y=view.counts,
            width=edges_mm[1] - edges_mm[0],
            marker_color=css(NEUTRAL),
            hovertemplate="%{x:.1f} mm: %{y} points<extra></extra>",
        )
        _line(figure, view.r_F_m, "r<sub>F</sub>", css(DELIVERED), 1.12)
        _line(figure, view.r_F_m + view.sigma_D_m, "r<sub>F</sub>+σ<sub>D</sub>", css(SOURCE), 1.12)
        for radius_m in radii_m:
            _line(figure, radius_m, "", css(LOSS), 1.0, dash="dot")
    figure.update_layout(
        template="plotly_white",
        margin={"l": 44, "r": 10, "t": 26, "b": 34},
        xaxis_title="nearest neighbour, mm (dotted: ball radii)",
        yaxis_title="points",
        showlegend=False,
        bargap=0,
        font={"size": 11},
    )
    figure.update_xaxes(rangemode="tozero")
    return figure


def _line(figure: go.Figure, at_m: float, label: str, color: str, top: float, dash: str = "solid") -> None:
    x = 1000.0 * at_m
    figure.add_shape(
        type="line", x0=x, x1=x, y0=0, y1=1, yref="paper", line={"color": color, "width": 2, "dash": dash}
    )
    if label:
        figure.add_annotation(x=x, y=top, yref="paper", text=label, showarrow=False, font={"color": color})
