"""Histogram of the distance to the nearest neighbour, with the radii that matter drawn in."""

from __future__ import annotations

from collections.abc import Sequence

import plotly.graph_objects as go

from app.drawing.colors import BRAND, DELIVERED, INFERRED, LOSS, SOURCE, css
from app.drawing.marks import add_bars, bar_figure, mark
from app.screens.surface.view import SpacingView

THESIS = {"r<sub>F</sub>": 0.0, "r<sub>F</sub>+¼σ": 0.25, "r<sub>F</sub>+½σ": 0.5, "r<sub>F</sub>+σ": 1.0}
"""The thesis's four radii as multiples of sigma_D above r_F (SPEC 5)."""
USED, ADVISED, OF_THESIS = "in use", "suggested", "thesis"
ROWS = (OF_THESIS, ADVISED, USED)
"""Rows of marks above the bars, the lowest first."""
MARK_COLORS = {USED: css(LOSS), ADVISED: css(INFERRED), OF_THESIS: css(BRAND)}
MARK_SYMBOLS = {USED: "circle", ADVISED: "diamond", OF_THESIS: "triangle-down"}
BARS_TOP, MARKS_BOTTOM = 0.62, 0.66


def spacing_figure(
    view: SpacingView | None, radii_m: Sequence[float] = (), suggested_m: Sequence[float] = ()
) -> go.Figure:
    """Bars in millimetres, lines at r_F and r_F + sigma_D, and above the bars the radii as marks.

    Args:
        view: the distances; an empty figure without.
        radii_m: balls in use.
        suggested_m: balls that the points suggest.
    """
    figure = bar_figure("nearest neighbour and ball radii, mm", "points")
    figure.update_layout(
        xaxis={"rangemode": "tozero", "anchor": "y"}, yaxis={"domain": [0.0, BARS_TOP]}, margin={"t": 20}
    )
    if view is None:
        return figure
    figure.update_layout(yaxis2=_mark_axis())
    add_bars(figure, 1000.0 * view.edges_m, view.counts, "mm", "points")
    thesis_m = [view.r_F_m + factor * view.sigma_D_m for factor in THESIS.values()]
    _marks(figure, OF_THESIS, thesis_m, tuple(THESIS))
    _marks(figure, ADVISED, suggested_m)
    _marks(figure, USED, radii_m)
    mark(figure, 1000.0 * view.r_F_m, "r<sub>F</sub>", css(DELIVERED), "right")
    mark(figure, 1000.0 * (view.r_F_m + view.sigma_D_m), "r<sub>F</sub>+σ<sub>D</sub>", css(SOURCE), "left")
    return figure


def _mark_axis() -> dict[str, object]:
    return {
        "domain": [MARKS_BOTTOM, 1.0],
        "range": [-0.6, len(ROWS) - 0.4],
        "tickvals": list(range(len(ROWS))),
        "ticktext": [f"<span style='color:{MARK_COLORS[row]}'>{row}</span>" for row in ROWS],
        "showgrid": False,
        "zeroline": False,
        "fixedrange": True,
    }


def _marks(figure: go.Figure, row: str, radii_m: Sequence[float], names: Sequence[str] = ()) -> None:
    color = MARK_COLORS[row]
    figure.add_scatter(
        x=[1000.0 * radius_m for radius_m in radii_m],
        y=[ROWS.index(row)] * len(radii_m),
        yaxis="y2",
        mode="markers",
        name=row,
        text=list(names) or [row] * len(radii_m),
        marker={"symbol": MARK_SYMBOLS[row], "size": 8, "color": color},
        hovertemplate="%{text}: %{x:.1f} mm<extra></extra>",
    )
