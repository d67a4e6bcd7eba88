"""The folder that replays the thesis's robustness experiment."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import plotly.graph_objects as go

from app.drawing.colors import BRAND, DELIVERED, LOSS, css
from app.screens.calibrate.noise_view import CLOSE, INSIDE_95, NoiseRequest, NoiseView
from app.screens.calibrate.numbers import UNITS
from app.tables import number, table
from app.ui import Ui

TEXT = """What if every circle were seen a little beside its place? The calibration above is taken as the
**truth**, its views are seen again with this noise on every point, and the camera is estimated anew, 200
times. The thesis did it once for each noise (Table 4.1)."""
THIS, OTHER = "this lens", "one of another kind"
PAIRS = {
    "fx against k1": ("fx", "k1"),
    "fx against fy": ("fx", "fy"),
    "cx against cy": ("cx", "cy"),
    "k1 against k2": ("k1", "k2"),
}
READY = "Drag the slider to begin."
STOPPED = "Stopped. Drag the slider to begin anew."
REST_S = 0.25
"""How long the slider has to rest before the experiment begins."""


class NoiseFolder:
    """A slider, the scatter of the trials as they come, and their numbers."""

    def __init__(self, ui: Ui, on_replay: Callable[[float, bool], None], on_stop: Callable[[], None]) -> None:
        """Add the folder.

        Args:
            ui: where to add it.
            on_replay: called with the noise in px, and whether the lens is of another kind.
            on_stop: called when what runs is to end.
        """
        self._on_replay, self._on_stop = on_replay, on_stop
        self._view: NoiseView | None = None
        self._wanted: tuple[float, bool] | None = None
        """What is being replayed."""
        gui = ui.gui
        self._resting = ui.debounce(REST_S, self._rested)
        self._folder = gui.add_folder("What if the points were noisier?", expand_by_default=False)
        with self._folder:
            gui.add_markdown(TEXT)
            self._sigma = gui.add_slider(
                "Noise (px)",
                0.0,
                1.0,
                0.05,
                0.5,
                hint="Standard deviation added to the column and the row of every point.",
            )
            ui.when_changed(self._sigma, self._moved)
            self._through = gui.add_dropdown(
                "Seen through",
                [THIS, OTHER],
                hint="The lens through which the views are seen: the one that was found, or one with "
                "distortions (p1, p2, k3) that the lens thesis does not know.",
            )
            ui.when_changed(self._through, self._moved)
            self._pair = gui.add_dropdown("Axes", list(PAIRS), hint="Which two parameters are plotted.")
            ui.when_changed(self._pair, self._draw)
            ui.buttons(
                "Experiment",
                {"Replay": self._rested, "Stop": self.stop},
                "Replay: begin anew with this noise. Stop: keep what there is.",
            )
            self._status = gui.add_markdown(READY)
            self._plot = gui.add_plotly(
                scatter_figure(None, *PAIRS["fx against k1"]),
                aspect=1.15,
                config={"displayModeBar": False},
                visible=False,
            )
            self._table = gui.add_html("")

    def set(self, sigma_px: float, other_lens: bool) -> None:
        """Choose for the person, and begin."""
        self._sigma.value, self._through.value = sigma_px, OTHER if other_lens else THIS
        self._rested()

    def forget(self) -> None:
        """What was replayed is of another camera, or of other views."""
        if self._wanted is not None:
            self._on_stop()
        self._view = self._wanted = None
        self._plot.visible = False
        self._table.content, self._status.content = "", READY

    def stop(self) -> None:
        """Keep what there is."""
        self._on_stop()

    def load(self, view: NoiseView) -> None:
        """Show what there is so far of the noise that is wanted; what comes late is of another one."""
        if not isinstance(view, NoiseView) or asked(view.request) != self._wanted or not view.trials:
            return
        self._view = view
        self._draw()
        self._table.content = noise_table(view)
        self._status.content = noise_line(view)

    def ended(self, view: NoiseView | None, request: NoiseRequest) -> None:
        """The last trial, or none: it was stopped or could not be."""
        if asked(request) != self._wanted:
            return
        if view is not None:
            self.load(view)
        elif self._view is None:
            self._status.content = STOPPED
        self._wanted = None

    def _moved(self) -> None:
        """Stop at once what runs with another noise; begin when the hand rests."""
        if self._wanted is not None:
            self._on_stop()
        self._resting.restart()

    def _rested(self) -> None:
        self._wanted, self._view = (float(self._sigma.value), self._through.value == OTHER), None
        self._status.content = "The first trials are coming …"
        self._on_replay(*self._wanted)

    def _draw(self) -> None:
        if self._view is not None:
            self._plot.figure = scatter_figure(self._view, *PAIRS[self._pair.value])
        self._plot.visible = self._view is not None


def asked(request: NoiseRequest) -> tuple[float, bool]:
    """The part of a request that the controls set."""
    return request.sigma_px, request.other_lens


def noise_line(view: NoiseView) -> str:
    """The experiment in some sentences."""
    done = (
        f"{view.trials} of {view.request.trials} trials"
        if view.trials < view.request.trials
        else "All trials"
    )
    told = (
        f"**{done}.** fx, fy, cx and cy are all within {100.0 * CLOSE:g} % of the truth in "
        f"**{100.0 * view.close_share:.0f} %** of them. RMS {view.rms_px:.3f} px; noise alone leaves "
        f"{np.sqrt(2.0) * view.request.sigma_px:.3f} px at most."
    )
    if not view.halved:
        return told
    beyond = f"{view.beyond_noise} of {view.halved}"
    return f"{told} Two halves of the views differ beyond noise in **{beyond}** trials."


def noise_table(view: NoiseView) -> str:
    """HTML: how far the trials are off, and how far they think they are."""
    hint = (
        "Error: root mean square of the trials' difference from the truth. Predicted: the standard error "
        "that each of them gives itself, in the mean. Where it can be trusted, the two agree."
    )
    rows = []
    for name in view.names:
        digits, unit = (2, "px") if name in UNITS else (4, "")
        off, told = view.rmse(name), view.predicted(name)
        ratio = number(off / told if told > 1e-12 else None, 2)
        rows.append((name, hint, number(off, digits, unit), number(told, digits, unit), ratio))
    return table(rows, ("error", "predicted", "ratio"))


def scatter_figure(view: NoiseView | None, x: str, y: str) -> go.Figure:
    """The trials, the truth as a cross, and the ellipse that should hold 95 % of them."""
    figure = go.Figure()
    figure.update_layout(
        template="plotly_white",
        margin={"l": 58, "r": 10, "t": 44, "b": 40},
        xaxis={"title": f"{x}, px" if x in UNITS else x, "nticks": 5},
        yaxis={"title": f"{y}, px" if y in UNITS else y, "nticks": 5},
        legend={"orientation": "h", "y": 1.0, "yanchor": "bottom", "x": 0.0},
        font={"size": 11},
    )
    if view is None or not view.trials:
        return figure
    inside = view.inside(x, y)
    told = f"{x} %{{x:.5g}}, {y} %{{y:.4g}}<extra></extra>"
    for rows, color, name in (
        (inside, BRAND, f"trials ({int(inside.sum())})"),
        (~inside, LOSS, f"outside ({int((~inside).sum())})"),
    ):
        marker = {"color": css(color), "size": 6, "opacity": 0.6}
        figure.add_scatter(
            x=view.column(x)[rows],
            y=view.column(y)[rows],
            mode="markers",
            marker=marker,
            name=name,
            hovertemplate=told,
        )
    ellipse = ellipse_points(np.array([view.true(x), view.true(y)]), view.pair_covariance(x, y))
    line = {"color": css(DELIVERED), "width": 2}
    figure.add_scatter(
        x=ellipse[:, 0], y=ellipse[:, 1], mode="lines", line=line, name="predicted, 95 %", hoverinfo="skip"
    )
    cross = {"symbol": "cross-thin", "size": 16, "line": {"color": "#111", "width": 3}}
    figure.add_scatter(
        x=[view.true(x)], y=[view.true(y)], mode="markers", marker=cross, name="truth", hovertemplate=told
    )
    return figure


def ellipse_points(center: np.ndarray, covariance: np.ndarray, count: int = 73) -> np.ndarray:
    """(count, 2) a closed line around 95 % of a normal distribution."""
    values, vectors = np.linalg.eigh(covariance)
    angle = np.linspace(0.0, 2.0 * np.pi, count)
    circle = np.column_stack([np.cos(angle), np.sin(angle)])
    return center + np.sqrt(INSIDE_95) * (circle * np.sqrt(np.maximum(values, 0.0))) @ vectors.T
