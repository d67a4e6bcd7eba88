"""The folder with the capture-range map: a start is green if a method arrives from it, otherwise red."""

from __future__ import annotations

import functools
from collections.abc import Callable

from app.screens.fuse.labels import MARKS
from app.screens.fuse.view import CAPTURE_SHIFTS_M, CAPTURE_TURNS_DEG, SUCCESS_M, CaptureView
from app.web.markup import Markdown, Markup
from app.window.tables import number
from app.window.ui import Ui

REACHED, MISSED = "#bfe6d6", "#f3cdc8"
COMPUTE, STOP = "Compute the map", "Stop the map"
TEXT = Markdown(
    """From which start poses does a method find the right pose? The map tries 25 of them, on 2000 points of
each cloud, with the methods, clouds and degradations chosen above."""
)
COMPUTING = Markdown("Computing; the bar at the top shows the progress.")
NO_MAP = Markdown("No map: the computation was stopped, failed, or the race has changed.")


class CaptureFolder:
    """A button that computes the map, and the map, whose cells start a race."""

    def __init__(
        self,
        ui: Ui,
        on_compute: Callable[[], None],
        on_stop: Callable[[], None],
        on_cell: Callable[[float, float], None],
    ) -> None:
        """Add the folder; ``on_cell`` gets a cell's rotation in degrees and translation in metres."""
        self._view: CaptureView | None = None
        gui = ui.gui
        with gui.add_folder("Capture range", expand_by_default=False):
            gui.add_markdown(TEXT)
            ui.buttons(
                "Map", {COMPUTE: on_compute, STOP: on_stop}, "The map takes some seconds; Stop cancels it."
            )
            self._status = gui.add_markdown(Markdown(""))
            self._lane = gui.add_dropdown("Map of", [f"{MARKS[0]} first"], hint="Method whose map is shown.")
            ui.when_changed(self._lane, self._show)
            self._map = gui.add_html(Markup(""))
            with gui.add_folder("Starts as buttons", expand_by_default=False):
                for turn_deg in CAPTURE_TURNS_DEG:
                    cells = {
                        cell_name(turn_deg, shift_m): functools.partial(on_cell, turn_deg, shift_m)
                        for shift_m in CAPTURE_SHIFTS_M
                    }
                    ui.buttons(f"Turn {turn_deg:.0f}°", cells, "Race from this start.")
        self.forget()

    def forget(self) -> None:
        """Remove the map, which belongs to another race."""
        self._view = None
        self._lane.visible = self._map.visible = False
        self._status.content = Markdown("")

    def wait(self) -> None:
        """Show that the map is being computed."""
        self.forget()
        self._status.content = COMPUTING

    def load(self, view: CaptureView | None) -> None:
        """Show a map; None if it was stopped, has failed or belongs to another race."""
        self.forget()
        if view is None:
            self._status.content = NO_MAP
            return
        self._view = view
        names = tuple(f"{mark} {label}" for mark, label in zip(MARKS, view.labels, strict=False))
        self._lane.options, self._lane.value = names, names[-1] if len(names) < 3 else names[0]
        self._lane.visible = self._map.visible = True
        self._show()

    def _show(self) -> None:
        if self._view is not None:
            self._map.content = capture_html(self._view, self._lane.options.index(self._lane.value))


def cell_name(turn_deg: float, shift_m: float) -> str:
    """Return the name of a start in the map."""
    return f"{turn_deg:.0f}° {100 * shift_m:.0f} cm"


def capture_html(view: CaptureView, lane: int) -> Markup:
    """Return the map as HTML: rows of rotations, columns of translations, final errors in the cells."""
    heads = Markup("").join(
        Markup("<th>{:.0f} cm</th>").format(100 * shift_m) for shift_m in CAPTURE_SHIFTS_M
    )
    lines = [Markup("<tr><th></th>{}</tr>").format(heads)]
    for row, turn_deg in enumerate(CAPTURE_TURNS_DEG):
        cells = Markup("").join(
            _cell(cell_name(turn_deg, shift_m), float(view.errors_m[lane, row, column]))
            for column, shift_m in enumerate(CAPTURE_SHIFTS_M)
        )
        lines.append(Markup("<tr><th>{:.0f}°</th>{}</tr>").format(turn_deg, cells))
    return Markup(
        "<div style='padding: 0 0.8em 0.5em; font-size: 12px'>{} Cells of <b>{}</b>: end error in cm; "
        "press a cell to race from its start.<table style='width: 100%; border-spacing: 2px; "
        "table-layout: fixed'>{}</table></div>"
    ).format(capture_sentence(view), view.labels[lane], Markup("").join(lines))


def capture_sentence(view: CaptureView) -> str:
    """Return a sentence with the number of starts from which each method arrives."""
    counts = (view.errors_m < SUCCESS_M).sum(axis=(1, 2))
    starts = view.errors_m[0].size
    reached = ", ".join(f"{label} {count}" for label, count in zip(view.labels, counts, strict=True))
    return f"Starts that end within {100 * SUCCESS_M:.0f} cm, of {starts}: {reached}."


def _cell(name: str, error_m: float) -> Markup:
    arrived = error_m < SUCCESS_M
    look = (
        f"width: 100%; padding: 3px 0; border: 1px solid #999; border-radius: 3px; cursor: pointer; "
        f"color: #222; font-size: 12px; background: {REACHED if arrived else MISSED}"
    )
    text = f"{'✓' if arrived else '✗'} {number(error_m, 1 if error_m < 0.1 else 0, scale=100.0)}"
    return Markup(
        '<td><button data-packetmesh-press="{}" title="{}: final error {}" style="{}">{}</button></td>'
    ).format(name, name, number(error_m, 1, "cm", 100.0), look, text)
