"""The folder of the depth sensor's own bias: its terms, and the curve before and after."""

from __future__ import annotations

import plotly.graph_objects as go

from app.drawing.colors import DELIVERED, LOSS, NEUTRAL, css
from app.screens.calibrate.view import BiasView
from app.tables import number, table
from app.ui import Ui

TEXT = """No registration repairs a sensor that measures everything too near. The board's plane says how deep
each of its pixels truly is, so the photographs that calibrate the lens calibrate the depth as well. Under
**Compare** is the picture of it."""


class DepthFolder:
    """Numbers and a curve of one camera's depth."""

    def __init__(self, ui: Ui) -> None:
        """Add the folder."""
        gui = ui.gui
        with gui.add_folder("What the depth sensor is off by", expand_by_default=False):
            gui.add_markdown(TEXT)
            self._table = gui.add_html("")
            self._plot = gui.add_plotly(
                bias_figure(None), aspect=0.85, config={"displayModeBar": False}, visible=False
            )
            self._note = gui.add_markdown("")

    def load(self, told: BiasView | str | None) -> None:
        """Show another camera's; None is still to come, a sentence says why there is none."""
        found = told if isinstance(told, BiasView) else None
        self._plot.visible = found is not None
        self._table.content = "" if found is None else bias_table(found)
        if found is not None:
            self._plot.figure = bias_figure(found)
            self._note.content = found.note and f"{found.note}."
        else:
            self._note.content = "Comparing depth with the board …" if told is None else str(told)


def bias_table(view: BiasView) -> str:
    """HTML: the terms that held-out views justify, and what they do."""
    meaning = {
        "Offset": "Added to every depth; with its 95 % interval.",
        "Scale": "How much longer depth truly is than measured; with its 95 % interval.",
        "Curvature": "Grows with the square of the depth; with its 95 % interval.",
    }
    rows = [
        (name, meaning[name], f"{value:+.2f} {unit}", f"{low:+.2f} to {high:+.2f}")
        for name, value, low, high, unit in view.rows
    ]
    if "map" in view.terms:
        rows.append(("Map", "A smooth map over the image, as a share of the depth.", "3 × 4 knots", ""))
    if not view.terms:
        rows.append(("Terms", "None makes views that had no part in the fit better.", "none", ""))
    rows.append(
        (
            "Error",
            "Root mean square of depth less the board's plane, views counted alike: measured, then "
            "corrected.",
            number(view.rms_before_m, 1, "mm", 1000.0),
            "→ " + number(view.rms_after_m, 1, "mm", 1000.0),
        )
    )
    return table(rows)


def bias_figure(view: BiasView | None) -> go.Figure:
    """Depth less the board's plane over the true depth, measured and corrected, and the bias found."""
    figure = go.Figure()
    figure.update_layout(
        template="plotly_white",
        margin={"l": 56, "r": 10, "t": 44, "b": 40},
        xaxis={"title": "distance of the board, m"},
        yaxis={"title": "depth is off by, mm"},
        legend={"orientation": "h", "y": 1.0, "yanchor": "bottom", "x": 0.0},
        font={"size": 11},
    )
    if view is None:
        return figure
    for values, color, name in (
        (view.before_m, LOSS, "measured"),
        (view.after_m, DELIVERED, "corrected"),
    ):
        figure.add_scatter(
            x=view.true_m,
            y=1000.0 * values,
            mode="markers",
            marker={"size": 3, "color": css(color), "opacity": 0.45},
            name=name,
            hovertemplate=f"%{{x:.2f}} m: %{{y:+.1f}} mm<extra>{name}</extra>",
        )
    at_m = view.curve_z_m - view.curve_m
    figure.add_scatter(
        x=at_m, y=1000.0 * view.curve_m, mode="lines", line={"color": css(LOSS)}, name="bias that was found"
    )
    for sign in (-1.96, 1.96):
        figure.add_scatter(
            x=at_m,
            y=1000.0 * sign * view.sd_m,
            mode="lines",
            line={"color": css(NEUTRAL), "dash": "dot", "width": 1},
            name="noise, 95 %",
            showlegend=sign > 0.0,
            hoverinfo="skip",
        )
    return figure
