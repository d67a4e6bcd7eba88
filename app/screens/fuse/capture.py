"""The folder with the capture-range map."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import viser

from app.records import CAPTURE_SHIFTS_M, CAPTURE_TURNS_DEG, CaptureView
from app.screens.fuse.capture_plot import CELLS, capture_html, cell_name
from app.screens.fuse.draw import MARKS

COMPUTE, STOP = "Compute the map", "Stop the map"
TEXT = """Which starts does a method come home from? 25 of them, on 2000 points of each cloud, with the
methods, clouds and damage chosen above."""
COMPUTING = "Computing; the bar at the top shows how far."


class CaptureFolder:
    """A button that has the map computed, and the map, whose cells start a race."""

    def __init__(
        self,
        gui: viser.GuiApi,
        post: Callable[..., None],
        changed: Callable[[Any, Callable[[], None]], None],
        on_press: Callable[[str], None],
        on_cell: Callable[[float, float], None],
    ) -> None:
        """Add the folder.

        Args:
            gui: where to add it.
            post: runs a function on the session's thread.
            changed: registers an action for a change of a handle by a person.
            on_press: called with ``COMPUTE`` or ``STOP``.
            on_cell: called with the rotation in degrees and the translation in metres of a cell.
        """
        self._view: CaptureView | None = None
        with gui.add_folder("Capture range", expand_by_default=False):
            gui.add_markdown(TEXT)
            keys = gui.add_button_group("Map", (COMPUTE, STOP), hint="It takes seconds; Stop ends it.")
            keys.on_click(lambda event: post(on_press, event.target.value))
            self._status = gui.add_markdown("")
            self._lane = gui.add_dropdown("Map of", [f"{MARKS[0]} first"], hint="Method whose map is shown.")
            changed(self._lane, self._show)
            self._map = gui.add_html("")
            with gui.add_folder("The cells as buttons", expand_by_default=False):
                for turn_deg in CAPTURE_TURNS_DEG:
                    names = tuple(cell_name(turn_deg, shift_m) for shift_m in CAPTURE_SHIFTS_M)
                    row = gui.add_button_group(
                        f"Turn {turn_deg:.0f}°", names, hint="Start so far from aligned, and race."
                    )
                    row.on_click(lambda event: post(on_cell, *CELLS[event.target.value]))
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
