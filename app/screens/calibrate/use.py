"""The row that applies a calibration to the chain and compares the surfaces."""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from app.compute.state import Spec
from app.screens.calibrate.request import inner
from app.web.markup import Markdown, Markup
from app.window.tables import UNKNOWN, number, table, truth_rows
from app.window.ui import Ui
from packetmesh.errors import InputError
from pipeline.sources import Calibrated, Recorded

if TYPE_CHECKING:
    from app.window.panel import PanelSession

USE, BEFORE = "Use this calibration", "As before"
WRITING = Markdown("Writing the calibration …")
IN_USE = Markdown("**In use** ({}): every later step uses it.")
WITHOUT, WITH = "as before", "calibrated"
"""Columns of the table."""


class UseRow:
    """Two buttons, and the surface's numbers with and without the calibration."""

    def __init__(self, ui: Ui, session: PanelSession) -> None:
        """Add the row to the current container."""
        self._session = session
        self._count = 0
        """Number of calibrations written."""
        self._folder = ""
        """Folder of the calibration that the chain uses, or used last."""
        self._surfaces: dict[str, tuple[Hashable, Any]] = {}
        """By column: the last surface, after everything that it depends on."""
        self._row = ui.buttons(
            "In the chain",
            {USE: self.use, BEFORE: self.put_back},
            "Use this calibration: compute all later steps with it. As before: compute them with the "
            "calibration that came with the rig.",
            visible=False,
        )
        self._text = ui.gui.add_markdown(Markdown(""))
        self._table = ui.gui.add_html(Markup(""))

    def show(self, visible: bool) -> None:
        """Show the row if there is a calibration to use."""
        self._row.visible = visible

    def use(self) -> None:
        """Write the calibration to a new folder, and let the chain use it.

        Raises:
            InputError: the scene is a recording.
        """
        source = inner(self._session.spec.source)
        if isinstance(source, Recorded):
            raise InputError(
                "A recording keeps its own camera; on the command line --recording takes other --intrinsics."
            )
        self._count += 1
        self._text.content = WRITING
        folder = str(self._session.new_folder() / f"calibration_{self._count:02d}")
        written = partial(self._written, source)
        self._session.quick_job("calibrate.use_job:use_job", folder, on_end=written)

    def _written(self, source: Any, folder: str | None) -> None:
        """Use a written calibration, unless there is none or another scene was opened meanwhile."""
        spec = self._session.spec
        if folder is None or inner(spec.source) != source:
            self.follow(spec)
        else:
            self._session.want(replace(spec, source=Calibrated(source, folder)))

    def put_back(self) -> None:
        """Let the chain use the calibration that came with the rig."""
        spec = self._session.spec
        self._session.want(replace(spec, source=inner(spec.source)))

    def surface(self, mesh: Any) -> None:
        """Take a new surface of the current settings."""
        spec = self._session.spec
        column = WITH if isinstance(spec.source, Calibrated) else WITHOUT
        self._surfaces[column] = spec.key("surface"), mesh
        self.follow(spec)

    def follow(self, spec: Spec) -> None:
        """Show which calibration the chain uses, and the surfaces that belong to these settings."""
        if isinstance(spec.source, Calibrated):
            self._folder = spec.source.folder
            self._text.content = IN_USE.format(Path(self._folder).name)
        else:
            self._text.content = Markdown("")
        before: Any = inner(spec.source)
        columns = {WITHOUT: before, WITH: Calibrated(before, self._folder)}
        meshes = {name: self._mesh(name, replace(spec, source=one)) for name, one in columns.items()}
        self._table.content = Markup("") if meshes[WITH] is None else surface_table(meshes)

    def _mesh(self, column: str, spec: Spec) -> Any:
        """Return a column's surface; None if it belongs to other settings."""
        key, mesh = self._surfaces.get(column, (None, None))
        return mesh if key == spec.key("surface") else None


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
