"""The common style of all plots, and the axes of an image."""

from __future__ import annotations

from typing import Any

import plotly.graph_objects as go
import plotly.io as pio

from app.drawing.colors import BRAND, css

_STYLE = pio.templates["plotly_white"].to_plotly_json()
BAND95 = 1.96
"""Standard deviations to each side that hold 95 % of a normal distribution."""


def titled_figure(title: str, x_title: str, y_title: str) -> go.Figure:
    """Return an empty plot with its legend below."""
    return styled_figure(
        title={"text": title, "font": {"size": 13, "color": css(BRAND)}, "x": 0.02},
        margin={"l": 56, "r": 10, "t": 34, "b": 40},
        xaxis={"title": x_title},
        yaxis={"title": y_title},
        font={"size": 11},
        legend={"orientation": "h", "y": -0.25},
    )


class _Styled(go.Figure):
    """A plot that gets the common style when it is written: plotly would check the style anew for each plot,
    which takes 10 ms.
    """

    def to_dict(self) -> dict[str, Any]:
        """Return the plot as plotly writes it."""
        plot: dict[str, Any] = super().to_dict()
        plot["layout"]["template"] = _STYLE
        return plot


def styled_figure(**layout: object) -> go.Figure:
    """Return an empty plot in the common style."""
    return _Styled(layout={"template": "none", **layout})


def image_figure(title: str, size_px: tuple[int, int]) -> go.Figure:
    """Return a plot with the axes of an image: the first row on top, square pixels."""
    width, height = size_px
    figure = titled_figure(title, "column, px", "row, px")
    figure.update_layout(
        xaxis={"range": [-0.5, width - 0.5], "showgrid": False, "constrain": "domain"},
        yaxis={"range": [height - 0.5, -0.5], "showgrid": False, "scaleanchor": "x", "constrain": "domain"},
        showlegend=False,
    )
    return figure


def faint(color: tuple[int, int, int]) -> str:
    """Return the CSS colour at 25 % opacity, to fill a band."""
    return "rgba({}, {}, {}, 0.25)".format(*color)
