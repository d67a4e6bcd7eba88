"""The folder that judges a camera for a range and an accuracy, with two curves of its lens."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import plotly.graph_objects as go

from app.drawing.calibration_plots import distortion_figure, radial_residuals_figure
from app.drawing.colors import DELIVERED, LOSS, css
from app.screens.calibrate.labels import TWO_HALVES
from app.screens.calibrate.view import TrustRequest, TrustView
from app.web.markup import Markdown, Markup, escape
from app.window.tables import number, table, term
from app.window.ui import Ui

REST_S = 0.3
OWN_M = 2.0
"""Range until a scene sets another."""
CURVES = {"distortion": "How far the lens moves a point", "left": "What it leaves along the radius"}


class TrustFolder:
    """Range and accuracy, the camera's errors there, and two curves of its lens."""

    def __init__(self, ui: Ui, on_change: Callable[[], None]) -> None:
        """Add the folder; ``on_change`` is called when the camera is to be judged again."""
        self._view: TrustView | None = None
        self._own_m = OWN_M
        self._resting = ui.debounce(REST_S, on_change)
        gui = ui.gui
        with gui.add_folder("Good enough for what?", expand_by_default=False):
            gui.add_markdown(
                Markdown("Say how far away things will be, and how well they are to be placed there.")
            )
            self._range = gui.add_slider(
                "Range (m)", 0.3, 6.0, 0.1, OWN_M, hint="Distance of what will be measured, from the camera."
            )
            self._accuracy = gui.add_slider(
                "Accuracy (mm)",
                0.5,
                20.0,
                0.5,
                5.0,
                hint="Within which a point at that range must be placed, across the line of sight.",
            )
            self._table = gui.add_html(Markup(""))
        with gui.add_folder("How the lens bends", expand_by_default=False):
            self._curve = gui.add_dropdown(
                "Curve", list(CURVES.values()), hint="Over the radius in the image."
            )
            self._plot = gui.add_plotly(
                go.Figure(), aspect=0.75, config={"displayModeBar": False}, visible=False
            )
        for handle in (self._range, self._accuracy):
            ui.when_changed(handle, self._resting.restart)
        ui.when_changed(self._curve, self._draw)

    def request(self, camera: str) -> TrustRequest:
        """Return the request for a camera."""
        return TrustRequest(camera, float(self._range.value), self._accuracy.value / 1000.0)

    def at_range(self, ranges_m: Sequence[float]) -> None:
        """Set the range to the mean of these distances."""
        self._own_m = round(sum(ranges_m) / len(ranges_m), 1)
        self.set(None)

    def set(self, range_m: float | None) -> None:
        """Set the range; None takes the scene's own."""
        self._range.value = self._own_m if range_m is None else range_m

    def load(self, view: TrustView | None) -> None:
        """Show the result; None clears it."""
        self._view = view
        self._table.content = Markup("") if view is None else trust_table(view)
        self._draw()

    def _draw(self) -> None:
        self._plot.visible = self._view is not None
        if self._view is not None:
            distortion = self._curve.value == CURVES["distortion"]
            self._plot.figure = (
                distortion_figure(self._view.bends)
                if distortion
                else radial_residuals_figure(self._view.left)
            )


def verdict_html(view: TrustView | None) -> Markup:
    """Return HTML of the verdict: a sign and its sentences."""
    if view is None:
        return Markup("")
    sign, color = ("✓ PASS", DELIVERED) if view.passed else ("✗ FAIL", LOSS)
    first, *rest = (escape(line) for line in view.lines)
    rest = [line.replace("Two halves", term("Two halves", TWO_HALVES)) for line in rest]
    more = Markup("").join(Markup("<div style='margin-top: 0.4em'>{}</div>").format(line) for line in rest)
    return Markup(
        "<div style='margin: 0 0.8em 0.6em; padding: 0.5em 0.8em; font-size: 13px; border-radius: 4px; "
        "border-left: 4px solid {}; background: rgba(120, 130, 140, 0.1)'>"
        "<b style='color: {}'>{}</b> {}{}</div>"
    ).format(css(color), css(color), sign, first, more)


def trust_table(view: TrustView) -> Markup:
    """Return a table in HTML: the error from noise, and the difference of two halves of the views."""
    return table(
        [
            (
                "Noise, 95 %",
                "Within which noise in the views leaves a point at the range 95 times in 100; root mean "
                "square over the image. A lens of the wrong kind does not show in it.",
                number(view.uncertainty_m, 2, "mm", 1000.0),
            ),
            (
                "Two halves apart",
                f"{TWO_HALVES} This is how far apart both put a point at the range, root mean square over "
                "the image. A lens of the wrong kind shows here.",
                number(view.difference_m, 2, "mm", 1000.0),
            ),
            (
                "Over what noise explains",
                "The difference of the halves over what noise alone lets one expect: near 1 if the lens is "
                "right.",
                "–" if view.halves is None else f"{view.halves[0]:.2f} ×",
            ),
            (
                "By chance up to",
                "Noise alone makes that ratio smaller in 95 of 100 cases; what is more is a lens, a view or "
                "a board that is wrong.",
                "–" if view.halves is None else f"{view.halves[1]:.2f} ×",
            ),
        ]
    )
