"""The noise experiment's trials in the dock: scatter plots around the truth, with the thesis's errors."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import plotly.graph_objects as go

from app.dock.plots import Sheet
from app.drawing.colors import BRAND, DELIVERED, INFERRED, LOSS, NEUTRAL, css
from app.drawing.plots import styled_figure
from app.screens.calibrate.noise_view import CLOSE, INSIDE_95, NoiseView
from app.screens.calibrate.numbers import UNITS, meanings
from app.web.markup import Markup
from app.window.tables import number, term
from pipeline.calibration.thesis_table import TABLE_4_1
from pipeline.types import FloatArray

PAIRS = (("fx", "fy"), ("cx", "cy"), ("k1", "k2"))
TEXT_PX, TICK_PX, DOT_PX = 17, 15, 8
REACH = 3.5
"""Least extent of the plot to each side of the truth, in standard errors."""
INK = "#111"
MORE = "more distortion (p1, p2, k3)"
"""Difference of the lens through which the points can be projected instead of the estimated one."""
ERROR = "Root mean square difference of the trials from the truth."
PREDICTED = (
    "Root mean square of the standard errors that the trials report; close to the error if they are reliable."
)
THESIS = (
    "Error of the thesis's value at the nearest noise level of Table 4.1: for f and c as the same share "
    "of this camera's value, for k1 and k2 as the same difference."
)


def noise_sheet(view: NoiseView) -> Sheet:
    """Return the dock's sheet of the trials so far."""
    cell = nearest_cell(view.request.sigma_px, view.names)
    request = view.request
    lens = f", through this lens with {MORE}" if request.other_lens else ""
    return Sheet(
        f"{request.camera}, {request.sigma_px:.2f} px of noise{lens}: {view.trials} of {request.trials} "
        "trials",
        legend_html(cell),
        tuple(scatter_figure(view, x, y, cell) for x, y in PAIRS),
        errors_html(view, cell),
    )


def legend_html(cell: Cell | None) -> Markup:
    """Return HTML of the legend."""
    signs = [
        (Markup('<i style="background: {}"></i>').format(css(BRAND)), "trial"),
        (Markup('<i style="background: {}"></i>').format(css(LOSS)), "trial outside"),
        (Markup('<i class="line" style="border-color: {}"></i>').format(css(DELIVERED)), "95 % predicted"),
        (Markup("<b>+ </b>"), "truth"),
        (
            Markup('<i class="line" style="border-top-style: dashed; border-color: {}"></i>').format(
                css(NEUTRAL)
            ),
            f"thesis: within {100.0 * CLOSE:g} %",
        ),
    ]
    if cell is not None:
        sign = Markup('<b style="color: {}">◆ </b>').format(css(INFERRED))
        signs.append((sign, f"thesis: printed at {cell.sigma_px:g} px (Table 4.1)"))
    return Markup("").join(Markup("<span>{}{}</span>").format(sign, text) for sign, text in signs)


def errors_html(view: NoiseView, cell: Cell | None) -> Markup:
    """Return a table: the trials' errors, their predicted standard errors, and the thesis's errors."""
    pad = "padding: 3px 0 3px 14px; text-align: right; font-variant-numeric: tabular-nums"
    heads = [term("error", ERROR), term("predicted", PREDICTED)]
    heads += [] if cell is None else [term("thesis", THESIS)]
    lines = [Markup("").join(Markup('<th style="{}">{}</th>').format(pad, head) for head in ("", *heads))]
    meaning = meanings(view.names)
    for name in view.names:
        digits, unit = (2, "px") if name in UNITS else (4, "")
        values = [number(view.rmse(name), digits, unit), number(view.predicted(name), digits, unit)]
        off = None if cell is None else cell.error(name, view.true(name))
        values += (
            []
            if cell is None
            else ["–" if off is None else f"{off:+.{digits}f} {unit}".strip().replace("-", "−")]
        )
        cells = Markup("").join(Markup('<td style="{}">{}</td>').format(pad, one) for one in values)
        lines.append(Markup('<td style="{}">{}</td>{}').format(pad, term(name, meaning[name]), cells))
    return Markup('<table style="border-collapse: collapse">{}</table>').format(
        Markup("").join(Markup("<tr>{}</tr>").format(line) for line in lines)
    )


def scatter_figure(view: NoiseView, x: str, y: str, cell: Cell | None) -> go.Figure:
    """Plot the trials, the truth as a cross, and the ellipse that should hold 95 % of them."""
    figure = styled_figure(
        margin={"l": 78, "r": 14, "t": 8, "b": 52},
        xaxis=_axis(view, x, cell),
        yaxis=_axis(view, y, cell),
        showlegend=False,
        font={"size": TICK_PX, "color": INK},
    )
    _add_claim(figure, view, x, y)
    inside = view.inside(x, y)
    for rows, color in ((inside, BRAND), (~inside, LOSS)):
        marker = {"color": css(color), "size": DOT_PX, "opacity": 0.55}
        _add_dots(figure, view.column(x)[rows], view.column(y)[rows], marker, (x, y), "trial")
    ellipse = ellipse_points(np.array([view.true(x), view.true(y)]), view.pair_covariance(x, y))
    line = {"color": css(DELIVERED), "width": 3}
    figure.add_scatter(x=ellipse[:, 0], y=ellipse[:, 1], mode="lines", line=line, hoverinfo="skip")
    true = np.array([view.true(x)]), np.array([view.true(y)])
    cross = {"symbol": "cross-thin", "size": 22, "line": {"color": INK, "width": 4}}
    _add_dots(figure, *true, cross, (x, y), "truth")
    off = (None, None) if cell is None else (cell.error(x, view.true(x)), cell.error(y, view.true(y)))
    if off[0] is not None and off[1] is not None:
        diamond = {"symbol": "diamond", "size": 15, "color": css(INFERRED)}
        diamond["line"] = {"color": "white", "width": 1}
        _add_dots(figure, true[0] + off[0], true[1] + off[1], diamond, (x, y), "thesis")
    return figure


def _axis(view: NoiseView, name: str, cell: Cell | None) -> dict[str, object]:
    """Return an axis around the truth that holds the trials and the thesis's errors."""
    true, found = view.true(name), view.column(name)
    off = None if cell is None else cell.error(name, true)
    reach = max(REACH * view.predicted(name), 1.1 * float(np.abs(found - true).max()), 1.2 * abs(off or 0.0))
    title = f"{name} (px)" if name in UNITS else f"{name} (no unit)"
    shown = max(reach, 1e-6)
    return {
        "title": {"text": title, "font": {"size": TEXT_PX}, "standoff": 6},
        "range": [true - shown, true + shown],
        "nticks": 5,
        "tickfont": {"size": TICK_PX},
        "zeroline": False,
    }


def _add_claim(figure: go.Figure, view: NoiseView, x: str, y: str) -> None:
    """Add the frame within which the thesis claims its estimates to be."""
    if x not in UNITS:
        return
    (left, right), (low, high) = (
        (true * (1.0 - CLOSE), true * (1.0 + CLOSE)) for true in (view.true(x), view.true(y))
    )
    line = {"color": css(NEUTRAL), "width": 2, "dash": "dash"}
    figure.add_shape(type="rect", x0=left, x1=right, y0=low, y1=high, line=line, layer="below")


def _add_dots(
    figure: go.Figure,
    x: FloatArray,
    y: FloatArray,
    marker: dict[str, object],
    names: tuple[str, str],
    label: str,
) -> None:
    hover = f"{label}<br>{names[0]} %{{x:.5g}}<br>{names[1]} %{{y:.5g}}<extra></extra>"
    figure.add_scatter(x=x, y=y, mode="markers", marker=marker, hovertemplate=hover)


def ellipse_points(center: FloatArray, covariance: FloatArray, count: int = 73) -> FloatArray:
    """Return (count, 2) points of the closed ellipse that holds 95 % of a 2-D normal distribution."""
    values, vectors = np.linalg.eigh(covariance)
    angle = np.linspace(0.0, 2.0 * np.pi, count)
    circle = np.column_stack([np.cos(angle), np.sin(angle)])
    return center + np.sqrt(INSIDE_95) * (circle * np.sqrt(np.maximum(values, 0.0))) @ vectors.T


NAMES = ("fx", "fy", "cx", "cy", "k1", "k2")
TRUE = (500.0, 500.0, 300.0, 250.0, 0.05, 0.1)
"""True parameters of the thesis's camera."""


@dataclass(frozen=True, slots=True)
class Cell:
    """The thesis's result at the noise nearest to a given one."""

    sigma_px: float
    errors: dict[str, float]
    """Errors by parameter: absolute for k1 and k2, for the others as a share of the truth."""

    def error(self, name: str, true: float) -> float | None:
        """Return the error for a parameter with this true value; None if the thesis does not estimate it."""
        off = self.errors.get(name)
        return None if off is None else off if name.startswith("k") else off * true


def nearest_cell(sigma_px: float, parameters: Sequence[str]) -> Cell | None:
    """Return the thesis's result at the nearest noise; None below half of the table's least noise.

    Args:
        sigma_px: the noise.
        parameters: names of the lens's parameters; with a k4, k1 and k2 mean something else and are omitted.
    """
    sigma = min(TABLE_4_1, key=lambda one: abs(one - sigma_px))
    if sigma_px < 0.5 * min(TABLE_4_1):
        return None
    printed = zip(NAMES, TABLE_4_1[sigma], TRUE, strict=True)
    errors = {
        name: value - true if name.startswith("k") else value / true - 1.0 for name, value, true in printed
    }
    if "k4" in parameters:
        del errors["k1"], errors["k2"]
    return Cell(sigma, errors)
