"""Arrows and rings in the first lane of a race, which change the start of all lanes."""

from __future__ import annotations

from collections.abc import Callable

import viser

from app.drawing.poses import place
from app.screens.fuse.draw import RaceDrawing, gizmo_pose
from app.screens.fuse.view import RaceView, Start
from app.window.ui import Ui


class StartGizmo:
    """A checkbox, and the gizmo that it shows at the start pose of the drawn race."""

    def __init__(self, ui: Ui, on_drag: Callable[[Start, bool], None]) -> None:
        """Add the checkbox; ``on_drag`` gets the start and whether the drag has ended."""
        self._ui, self._on_drag = ui, on_drag
        self._race: tuple[RaceDrawing, RaceView, Start] | None = None
        self._handle: viser.TransformControlsHandle | None = None
        self._checkbox = ui.gui.add_checkbox(
            "Drag",
            False,
            hint="Arrows and rings in the first lane change the start of all lanes.",
        )
        ui.when_changed(self._checkbox, self._place)

    def load(self, drawing: RaceDrawing, view: RaceView, start: Start) -> None:
        """Move to the start of another race."""
        self._race, self._handle = (drawing, view, start), None
        self._place()

    def forget(self) -> None:
        """Forget the gizmo, which is removed with the drawing of its race."""
        self._race = self._handle = None

    def hide(self) -> None:
        """Clear the checkbox and hide the gizmo."""
        self._checkbox.value = False
        self._place()

    def _place(self) -> None:
        """Put the gizmo at the race's start, or hide it."""
        if self._race is None:
            return
        drawing, view, start = self._race
        if self._handle is None and self._checkbox.value:
            self._handle = drawing.add_gizmo(start, lambda *drag: self._ui.post(self._dragged, *drag))
        if self._handle is not None:
            place(self._handle, gizmo_pose(start, view.center_m))
            self._handle.visible = self._checkbox.value

    def _dragged(self, start: Start, ended: bool) -> None:
        if self._race is None:
            return
        drawing, _, before = self._race
        with self._ui.atomic():
            drawing.preview(before, start)
            self._on_drag(start, ended)
