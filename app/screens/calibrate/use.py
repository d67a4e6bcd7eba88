"""The row that applies a calibration to the chain and compares the surfaces."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from app.web.markup import Markdown, Markup
from app.window.tables import UNKNOWN, number, table, truth_rows
from app.window.ui import Ui

USE, BEFORE = "Use this calibration", "As before"
WRITING = "Writing the calibration …"


class UseRow:
    """Two buttons, and the surface's numbers with and without the calibration."""

    def __init__(self, ui: Ui, on_use: Callable[[], None], on_before: Callable[[], None]) -> None:
        """Add the row to the current container."""
        self._row = ui.buttons(
            "In the chain",
            {USE: on_use, BEFORE: on_before},
            "Use this calibration: compute all later steps with it. As before: compute them with the "
            "calibration that came with the rig.",
            visible=False,
        )
        self._text = ui.gui.add_markdown(Markdown(""))
        self._table = ui.gui.add_html(Markup(""))
        self._surfaces: dict[bool, Any] = {}

    def show(self, visible: bool) -> None:
        """Show the row if there is a calibration to use."""
        self._row.visible = visible

    def show_status(self, sentence: str) -> None:
        """Show a status sentence."""
        self._text.content = Markdown.escape(sentence)

    def used(self, folder: str | None) -> None:
        """Show which calibration the chain uses, and forget the surface of an earlier calibration.

        ``folder`` is the calibration's; None if the chain uses none.
        """
        name = "" if folder is None else Path(folder).name
        in_use = Markdown("**In use** ({}): every later step uses it.").format(name)
        self._text.content = in_use if name else Markdown("")
        if folder is not None:
            self._surfaces.pop(True, None)
        self._draw()

    def surface(self, mesh: Any, calibrated: bool) -> None:
        """Take a new surface, computed with the calibration or without."""
        self._surfaces[calibrated] = mesh
        self._draw()

    def forget(self) -> None:
        """Forget the surfaces, which belong to another scene."""
        self._surfaces = {}
        self.used(None)

    def _draw(self) -> None:
        columns = {"as before": self._surfaces.get(False), "calibrated": self._surfaces.get(True)}
        if columns["calibrated"] is None:
            self._table.content = Markup("")
            return
        self._table.content = surface_table(columns)


def surface_table(columns: dict[str, Any]) -> Markup:
    """Return a table in HTML of the surfaces' numbers, a column per mesh; a dash for a missing one."""
    meshes = list(columns.values())
    rows = [
        (
            "Rays without a surface",
            "Share of the cameras' pixel rays that meet no surface: the holes.",
            *(number(mesh and mesh.quality.no_hit_ray_share, 1, "%", 100.0) for mesh in meshes),
        )
    ]
    if any(mesh is not None and mesh.truth for mesh in meshes):
        rows += truth_rows(meshes, UNKNOWN)
    return table(rows, tuple(f"surface {name}" for name in columns))
