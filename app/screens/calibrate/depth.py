"""The folder of the depth sensor's bias: its terms, and the curve before and after the correction."""

from __future__ import annotations

import plotly.graph_objects as go

from app.drawing.depth_bias_plots import bias_figure
from app.screens.calibrate.view import BiasView
from app.web.markup import Markdown, Markup
from app.window.tables import number, table
from app.window.ui import Ui

TEXT = Markdown(
    """Registration cannot correct a sensor that measures everything too near. The board's plane gives the
true depth of each of its pixels, so the photographs that calibrate the lens also calibrate the depth.
**Compare** has the picture of the error."""
)


class DepthFolder:
    """Numbers and a curve of one camera's depth bias."""

    def __init__(self, ui: Ui) -> None:
        """Add the folder."""
        gui = ui.gui
        with gui.add_folder("Bias of the depth sensor", expand_by_default=False):
            gui.add_markdown(TEXT)
            self._table = gui.add_html(Markup(""))
            self._plot = gui.add_plotly(
                go.Figure(), aspect=0.85, config={"displayModeBar": False}, visible=False
            )
            self._note = gui.add_markdown(Markdown(""))

    def load(self, bias: BiasView | str | None) -> None:
        """Show a camera's bias. None: it is not computed yet; a text: the reason why there is none."""
        found = bias if isinstance(bias, BiasView) else None
        self._plot.visible = found is not None
        self._table.content = Markup("") if found is None else bias_table(found)
        if found is not None:
            self._plot.figure = bias_figure(found.curve)
            self._note.content = Markdown("{}.").format(found.note) if found.note else Markdown("")
        else:
            self._note.content = Markdown.escape("Comparing depth with the board …" if bias is None else bias)


def bias_table(view: BiasView) -> Markup:
    """Return a table in HTML of the terms that held-out views justify, and their effect."""
    meaning = {
        "Offset": "Constant that is added to every depth; with its 95 % interval.",
        "Scale": "Share of the depth that is added to it; with its 95 % interval.",
        "Curvature": "Added in proportion to the square of the depth; with its 95 % interval.",
    }
    rows = [
        (name, meaning[name], f"{value:+.2f} {unit}", f"{low:+.2f} to {high:+.2f}")
        for name, value, low, high, unit in view.rows
    ]
    if "map" in view.terms:
        rows.append(
            ("Map", "Smooth map of corrections over the image, as a share of the depth.", "3 × 4 knots", "")
        )
    if not view.terms:
        rows.append(("Terms", "No term improves the prediction of held-out views.", "none", ""))
    rows.append(
        (
            "Error",
            "Root mean square of depth minus the board's plane, all views with equal weight: measured → "
            "corrected.",
            number(view.rms_before_m, 1, "mm", 1000.0),
            "→ " + number(view.rms_after_m, 1, "mm", 1000.0),
        )
    )
    return table(rows)
