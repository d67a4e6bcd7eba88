"""The folder with the capture-range map."""

from __future__ import annotations

import functools
from collections.abc import Callable

from app.screens.fuse.capture_plot import capture_html, cell_name
from app.screens.fuse.draw import MARKS
from app.screens.fuse.view import CAPTURE_SHIFTS_M, CAPTURE_TURNS_DEG, CaptureView
from app.ui import Ui

COMPUTE, STOP = "Compute the map", "Stop the map"
TEXT = """Which starts does a method come home from? 25 of them, on 2000 points of each cloud, with the
methods, clouds and damage chosen above."""
COMPUTING = "Computing; the bar at the top shows how far."


class CaptureFolder:
    """A button that has the map computed, and the map, whose cells start a race."""

    def __init__(
        self,
        ui: Ui,
        on_compute: Callable[[], None],
        on_stop: Callable[[], None],
        on_cell: Callable[[float, float], None],
    ) -> None:
        """Add the folder.

        Args:
            ui: where to add it.
            on_compute: called when the map is wanted.
            on_stop: called when it is no longer wanted.
            on_cell: called with the rotation in degrees and the translation in metres of a cell.
        """
        self._view: CaptureView | None = None
        gui = ui.gui
        with gui.add_folder("Capture range", expand_by_default=False):
            gui.add_markdown(TEXT)
            ui.buttons("Map", {COMPUTE: on_compute, STOP: on_stop}, "It takes seconds; Stop ends it.")
            self._status = gui.add_markdown("")
            self._lane = gui.add_dropdown("Map of", [f"{MARKS[0]} first"], hint="Method whose map is shown.")
            ui.when_changed(self._lane, self._show)
            self._map = gui.add_html("")
            with gui.add_folder("The cells as buttons", expand_by_default=False):
                for turn_deg in CAPTURE_TURNS_DEG:
                    cells = {
                        cell_name(turn_deg, shift_m): functools.partial(on_cell, turn_deg, shift_m)
                        for shift_m in CAPTURE_SHIFTS_M
                    }
                    ui.buttons(f"Turn {turn_deg:.0f}°", cells, "Start so far from aligned, and race.")
        self.forget()

    def forget(self) -> None:
        """The map of another race is not the map of this one."""
        self._view = None
        self._lane.visible = self._map.visible = False
        self._status.content = ""

    def wait(self) -> None:
        """Say that it is being computed."""
        self.forget()
        self._status.content = COMPUTING

    def load(self, view: CaptureView | None) -> None:
        """Show a map; None was stopped."""
        self.forget()
        if view is None:
            self._status.content = "Stopped."
            return
        self._view = view
        names = tuple(f"{mark} {label}" for mark, label in zip(MARKS, view.labels, strict=False))
        self._lane.options, self._lane.value = names, names[-1] if len(names) < 3 else names[0]
        self._lane.visible = self._map.visible = True
        self._show()

    def _show(self) -> None:
        if self._view is not None:
            self._map.content = capture_html(self._view, self._lane.options.index(self._lane.value))
