"""Plots over the ball radius of a sweep: rays and accuracy above, triangles and time below."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import plotly.graph_objects as go

from app.drawing.colors import BRAND, DELIVERED, INFERRED, LOSS, NEUTRAL, SOURCE, TARGET, css
from app.drawing.marks import add_bars, bar_figure, mark
from app.drawing.plots import styled_figure
from app.screens.surface.view import SpacingView, SweepView
from app.web.markup import Markdown
from pipeline.surface.findings import SweepPoint

NO_HIT, ACCURATE, LEFT, RIGHT = css(LOSS), css(TARGET), css(NEUTRAL), css(INFERRED)
WORK, POINTS = "triangles and time", "unused points and hole area"
BELOW = (WORK, POINTS)
"""Choices for the lower plot."""
TICKS_MM = (1, 2, 5, 10, 20, 50, 100, 200, 500)
AXIS_ENDS = (0.47, 6.4)
"""Ends of the axis of a whole sweep, in r_F."""
LEVEL_SHARE = 0.01
"""Closing less than this share of the rays is no noticeable effect of a larger ball."""


def sweep_figure(view: SweepView | None, below: str = WORK) -> go.Figure:
    """Return two plots above each other, over the ball radius in millimetres on a logarithmic axis.

    Args:
        view: results by ball radius; None gives an empty figure.
        below: curves of the lower plot, one of ``BELOW``.
    """
    left, right = ("triangles", "ball, ms") if below == WORK else ("unused, %", "holes, m²")
    figure = styled_figure(
        margin={"l": 48, "r": 48, "t": 20, "b": 36},
        xaxis=_radius_axis(view),
        yaxis={"title": _colored_title(("rays without", NO_HIT), ("≤ 1 cm, %", ACCURATE)), "range": [0, 104]},
        yaxis2={"title": _colored_title((left, LEFT)), "rangemode": "tozero"},
        yaxis3={"title": _colored_title((right, RIGHT)), "rangemode": "tozero", "showgrid": False},
        showlegend=False,
        font={"size": 11},
        hovermode="closest",
    )
    figure.update_layout(
        yaxis={"domain": [0.56, 1.0], "nticks": 4},
        yaxis2={"domain": [0.0, 0.46], "nticks": 4},
        yaxis3={"overlaying": "y2", "side": "right", "nticks": 4},
    )
    if view is not None and view.points:
        _fill(figure, view, below)
    return figure


def _fill(figure: go.Figure, view: SweepView, below: str) -> None:
    rows = view.points
    accuracies = [100 * row.accuracy_1cm for row in rows]
    curves: list[tuple[Sequence[float], str, str, str]] = [
        ([100 * row.no_hit_ray_share for row in rows], "y", NO_HIT, "%{y:.1f} % of rays without a surface"),
    ]
    if not np.isnan(accuracies).all():
        curves.append((accuracies, "y", ACCURATE, "%{y:.1f} % of the surface within 1 cm of the truth"))
    if below == WORK:
        curves += [
            ([row.triangles for row in rows], "y2", LEFT, "%{y:,d} triangles"),
            ([1000 * row.elapsed_s for row in rows], "y3", RIGHT, "%{y:.0f} ms for the ball"),
        ]
    else:
        curves += [
            ([100 * row.unused_share for row in rows], "y2", LEFT, "%{y:.1f} % of the points unused"),
            ([row.hole_area_m2 for row in rows], "y3", RIGHT, "%{y:.3f} m² of holes"),
        ]
    for values, axis, color, meaning in curves:
        figure.add_scatter(
            x=[1000 * row.radius_m for row in rows],
            y=values,
            yaxis=axis,
            mode="lines+markers",
            line={"color": color, "width": 2},
            marker={"size": 5},
            hovertemplate=f"%{{x:.1f}} mm: {meaning}<extra></extra>",
        )
    widest_mm = 1000.0 * (view.r_F_m + view.sigma_D_m)
    mark(figure, 1000.0 * view.r_F_m, "r<sub>F</sub>", css(DELIVERED), "right", "dot", log=True)
    mark(figure, widest_mm, "r<sub>F</sub>+σ<sub>D</sub>", css(SOURCE), "left", "dot", log=True)


def sweep_sentence(view: SweepView) -> Markdown:
    """Return a sentence on the radius above which balls close hardly more rays, and on their accuracy."""
    rows = [row for row in view.points if row.triangles]
    if not rows:
        return Markdown("No ball of the sweep leaves a triangle.")
    missed = np.array([row.no_hit_ray_share for row in rows])
    best = int(missed.argmin())
    level = int(np.flatnonzero(missed < missed[best] + LEVEL_SHARE)[0])
    start, last = rows[level], rows[-1]
    parts = [
        f"From {_mm(start)} on, larger balls close less than {LEVEL_SHARE:.0%} more of the rays "
        f"({start.no_hit_ray_share:.1%} are without a surface)"
    ]
    if missed[-1] >= missed[best] + LEVEL_SHARE:
        parts.append(f"with the widest ball, {_mm(last)}, {missed[-1]:.1%} are without a surface again")
    if level < len(rows) - 1 and math.isfinite(start.accuracy_1cm):
        change = _change_text(start.accuracy_1cm, last.accuracy_1cm)
        parts.append(f"accuracy within 1 cm {change} up to {_mm(last)}")
    return Markdown("; ").join(parts) + Markdown(".")


def _mm(row: SweepPoint) -> str:
    return f"{1000 * row.radius_m:.0f} mm"


def _change_text(first: float, last: float) -> str:
    """Return the change as text; rounded shares are compared, so that 93 % does not rise to 93 %."""
    before, after = round(100 * first), round(100 * last)
    if before == after:
        return f"stays at {after} %"
    return f"{'falls' if after < before else 'rises'} from {before} to {after} %"


def _colored_title(*parts: tuple[str, str]) -> str:
    return ", ".join(f"<span style='color:{color}'>{text}</span>" for text, color in parts)


def _radius_axis(view: SweepView | None) -> dict[str, object]:
    axis: dict[str, object] = {
        "title": "ball radius, mm",
        "type": "log",
        "tickvals": TICKS_MM,
        "anchor": "y2",
    }
    if view is not None and view.points:
        # The axis has its final width from the first ball on, so that it does not jump during the sweep.
        widest_m = max(AXIS_ENDS[1] * view.r_F_m, 1.05 * view.points[-1].radius_m)
        ends_mm = 1000 * AXIS_ENDS[0] * view.r_F_m, 1000 * widest_m
        axis["range"] = [math.log10(end_mm) for end_mm in ends_mm]
    return axis


THESIS = {"r<sub>F</sub>": 0.0, "r<sub>F</sub>+¼σ": 0.25, "r<sub>F</sub>+½σ": 0.5, "r<sub>F</sub>+σ": 1.0}
"""The thesis's four radii as multiples of sigma_D above r_F (SPEC 5)."""
USED, ADVISED, OF_THESIS = "in use", "suggested", "thesis"
ROWS = (OF_THESIS, ADVISED, USED)
"""Rows of marks above the bars, from the lowest."""
MARK_COLORS = {USED: css(LOSS), ADVISED: css(INFERRED), OF_THESIS: css(BRAND)}
MARK_SYMBOLS = {USED: "circle", ADVISED: "diamond", OF_THESIS: "triangle-down"}
BARS_TOP, MARKS_BOTTOM = 0.62, 0.66


def spacing_figure(
    view: SpacingView | None, radii_m: Sequence[float] = (), suggested_m: Sequence[float] = ()
) -> go.Figure:
    """Return a histogram of the distances, mm, with lines at r_F and r_F + sigma_D and marks at the radii.

    Args:
        view: the distances; None gives an empty figure.
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
