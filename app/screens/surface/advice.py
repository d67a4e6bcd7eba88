"""The folder with advice on the ball radius: from the points, and from a sweep of all radii."""

from __future__ import annotations

from collections.abc import Callable

from app.screens.surface.sweep_plot import BELOW, sweep_figure, sweep_sentence
from app.screens.surface.view import SweepView
from app.web.markup import Markdown, Markup
from app.window.tables import number, table
from app.window.ui import Ui
from pipeline.config import SurfaceConfig
from pipeline.surface.findings import Suggestion

TEXT = Markdown(
    """A ball can close the triangles around a point only if its radius is at least that of their largest
circumcircle. The app computes this radius from the points before any ball rolls."""
)
NO_ADVICE = "No point has neighbours on all sides, so this cloud gives no radius; try more points."
WAITING = Markdown("The first ball is about to roll.")
NO_CURVES = Markdown("No curves: the computation was stopped or failed.")
STOPPED = Markdown("Stopped or failed; the curves show the balls that have rolled.")
UNNAMED = "–"
"""Label of the only button before there is a suggestion; it is hidden."""


class AdviceFolder:
    """Buttons that take suggested radii, and a sweep that shows the effect of every radius."""

    def __init__(
        self,
        ui: Ui,
        on_sweep: Callable[[], None],
        on_stop: Callable[[], None],
        on_radius_m: Callable[[float], None],
    ) -> None:
        """Add the folder; ``on_radius_m`` is called with the suggested radius of a pressed button."""
        self._on_sweep, self._on_radius_m = on_sweep, on_radius_m
        self._radii_m: dict[str, float] = {}
        self._view: SweepView | None = None
        self._cloud: tuple[int, int] | None = None
        gui = ui.gui
        with gui.add_folder("Which radius?", expand_by_default=False):
            gui.add_markdown(TEXT)
            self._table = gui.add_html(Markup(""))
            self._take = gui.add_button_group(
                "Take", (UNNAMED,), hint="Roll one ball of this radius.", visible=False
            )
            self._take.on_click(lambda event: ui.post(self._taken, event.target.value))
            ui.buttons(
                "All radii",
                {"Sweep the radius": self._sweep, "Stop the sweep": on_stop},
                "Rolls balls of increasing radius, each alone over the cloud after fusion; this takes "
                "some seconds.",
            )
            self._status = gui.add_markdown(Markdown(""))
            self._below = gui.add_dropdown(
                "Lower plot", list(BELOW), hint="Quantities in the lower of the two plots.", visible=False
            )
            ui.when_changed(self._below, self._draw)
            self._plot = gui.add_plotly(
                sweep_figure(None), aspect=0.95, config={"displayModeBar": False}, visible=False
            )
        self.forget()

    def suggest(self, rows: tuple[Suggestion, ...]) -> None:
        """Show the radii that the points suggest."""
        self._radii_m = {row.name: row.radius_m for row in rows}
        if rows:
            self._take.options = tuple(self._radii_m)
        self._take.visible = bool(rows)
        self._table.content = suggestions_html(rows)

    def load(self, view: SweepView | None) -> None:
        """Show a sweep, complete or partial; None if it was stopped or failed."""
        if view is None:
            self._status.content = NO_CURVES if self._view is None else STOPPED
            return
        self._view = view
        self._draw()
        running = Markdown("{} of {} balls have rolled.").format(len(view.points), view.planned)
        self._status.content = sweep_sentence(view) if view.done else running

    def keep_for(self, surface: SurfaceConfig) -> None:
        """Remove the radii if these settings give another cloud than the settings before."""
        cloud = surface.max_points, surface.smoothing_passes
        if cloud != self._cloud:
            self.forget()
        self._cloud = cloud

    def forget(self) -> None:
        """Remove the radii, which belong to another cloud."""
        self._radii_m, self._view = {}, None
        self._take.visible = False
        self._draw()
        self._table.content, self._status.content = Markup(""), Markdown("")

    def _draw(self) -> None:
        if self._view is not None:
            self._plot.figure = sweep_figure(self._view, self._below.value)
        self._plot.visible = self._below.visible = self._view is not None

    def _taken(self, name: str) -> None:
        if name in self._radii_m:
            self._on_radius_m(self._radii_m[name])

    def _sweep(self) -> None:
        self._view = None
        self._draw()
        self._status.content = WAITING
        self._on_sweep()


def suggestions_html(rows: tuple[Suggestion, ...]) -> Markup:
    """Return HTML with a line per suggested radius: name, radius, and the share that it closes."""
    if not rows:
        return Markup("<div style='padding: 0 0.8em; font-size: 13px'>{}</div>").format(NO_ADVICE)
    return table(
        [
            (row.name, row.sentence, number(row.radius_m, 1, "mm", 1000.0), number(row.share, 0, "%", 100.0))
            for row in rows
        ],
        ("radius", "closes"),
    )
