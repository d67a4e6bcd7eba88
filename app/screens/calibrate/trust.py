"""The folder that judges a camera for a range and an accuracy, with two curves of its lens."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import plotly.graph_objects as go

from app.drawing.calibration_plots import distortion_figure, radial_residuals_figure
from app.drawing.colors import DELIVERED, LOSS, NEUTRAL, css
from app.screens.calibrate.labels import TWO_HALVES
from app.screens.calibrate.view import TrustRequest, TrustView
from app.web.markup import Markdown, Markup, escape
from app.window.tables import number, table
from app.window.ui import Ui

REST_S = 0.3
OWN_M = 2.0
"""Range until a scene sets another, metres."""
CURVES = {"distortion": "Distortion of a point", "left": "Residuals along the radius"}


class TrustFolder:
    """Range and accuracy, the camera's errors there, and two curves of its lens."""

    def __init__(self, ui: Ui, on_change: Callable[[], None]) -> None:
        """Add the folder; ``on_change`` is called when the camera is to be judged again."""
        self._view: TrustView | None = None
        self._own_m = OWN_M
        """The scene's own range."""
        self._chosen_m: float | None = None
        """Range set by hand or by a stop; None is the scene's own."""
        self._resting = ui.debounce(REST_S, on_change)
        gui = ui.gui
        with gui.add_folder("Good enough for what?", expand_by_default=False):
            gui.add_markdown(
                Markdown("Set the distance at which you will measure, and the accuracy that you need there.")
            )
            self._range = gui.add_slider(
                "Range (m)",
                0.3,
                6.0,
                0.1,
                OWN_M,
                hint="Distance from the camera at which you will measure.",
            )
            self._accuracy = gui.add_slider(
                "Accuracy (mm)",
                0.5,
                20.0,
                0.5,
                5.0,
                hint="Largest allowed error of a point at that range, across the line of sight.",
            )
            self._table = gui.add_html(Markup(""))
        with gui.add_folder("Distortion of the lens", expand_by_default=False):
            self._curve = gui.add_dropdown(
                "Curve", list(CURVES.values()), hint="Curve to plot over the radius in the image."
            )
            self._plot = gui.add_plotly(
                go.Figure(), aspect=0.75, config={"displayModeBar": False}, visible=False
            )
        ui.when_changed(self._range, self._picked_range)
        ui.when_changed(self._accuracy, self._resting.restart)
        ui.when_changed(self._curve, self._draw)

    def request(self, camera: str) -> TrustRequest:
        """Return the request for a camera."""
        return TrustRequest(camera, float(self._range.value), self._accuracy.value / 1000.0)

    def at_range(self, ranges_m: Sequence[float]) -> None:
        """Make the mean of these distances, rounded to 0.1 m, the scene's own range."""
        self._own_m = round(sum(ranges_m) / len(ranges_m), 1)
        self.set(self._chosen_m)

    def set(self, range_m: float | None) -> None:
        """Set the range; None takes the scene's own, also that of a later scene."""
        self._chosen_m = range_m
        self._range.value = self._own_m if range_m is None else range_m

    def _picked_range(self) -> None:
        self._chosen_m = float(self._range.value)
        self._resting.restart()

    def load(self, view: TrustView | None) -> None:
        """Show the result; None clears it."""
        if view is self._view:
            return
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
    undecided = "? NOT DECIDED", NEUTRAL
    sign, color = ("✓ PASS", DELIVERED) if view.passed else ("✗ FAIL", LOSS) if view.failed else undecided
    first, *rest = (escape(line) for line in view.lines)
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
                "Error of a point at the range that noise in the views exceeds in only 5 of 100 cases; "
                "root mean square over the image. It does not reveal a wrong lens model.",
                number(view.uncertainty_m, 2, "mm", 1000.0),
            ),
            (
                "Two halves apart",
                f"{TWO_HALVES} This is the distance between the two results for a point at the range, "
                "root mean square over the image; it reveals a wrong lens model.",
                number(view.difference_m, 2, "mm", 1000.0),
            ),
            (
                "Ratio to noise",
                "Difference of the halves divided by the difference that noise alone explains; near 1 if "
                "the lens model is right.",
                "–" if view.halves is None else f"{view.halves[0]:.2f} ×",
            ),
            (
                "Limit of the ratio",
                "Noise alone keeps the ratio below this limit in 95 of 100 cases. A larger ratio means "
                "that the lens model, a view or the board is wrong.",
                "–" if view.halves is None else f"{view.halves[1]:.2f} ×",
            ),
        ]
    )
