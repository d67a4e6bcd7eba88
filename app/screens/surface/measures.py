"""Measures on the surface after fusion, which also go into the report and the exports."""

from __future__ import annotations

from dataclasses import replace

from app.compute.measures import Tape
from app.measuring.folder import MeasureFolder
from app.window.panel import PanelSession


class SurfaceMeasures(MeasureFolder):
    """The folder *Measure* of the Surface screen."""

    def __init__(self, session: PanelSession) -> None:
        """Add the folder to the current container; the surface's scene nodes must exist already."""
        super().__init__(session, "/surface/after/measures", "surface.measure_job:measure_job", self._keep)

    def follow(self) -> None:
        """Measure on the current settings' surface, or show no numbers until it is computed."""
        if self._session.results.fresh("surface", self._session.spec):
            self.load()
        else:
            self.unload()

    def _keep(self, tape: Tape) -> None:
        self._session.want(replace(self._session.spec, tape=tape))
