"""Plots in the dock at the lower edge of the window, large enough for a class to read.

The page's part is ``dock_plots.js``. The server sends everything in one hidden piece of HTML.
"""

from __future__ import annotations

import json
import uuid
from collections.abc import Sequence
from dataclasses import dataclass

import plotly.graph_objects as go

from app.web.markup import Markup
from app.window.hidden import add_hidden
from app.window.page import page_call
from app.window.ui import Ui

NO_TABLE = Markup("")


@dataclass(frozen=True, slots=True)
class Sheet:
    """The plots, legend and table that are shown together."""

    title: str
    legend: Markup
    """HTML of the legend of all plots."""
    figures: tuple[go.Figure, ...]
    table: Markup = NO_TABLE
    """HTML to the right of the plots."""


class PlotDock:
    """Shows plots side by side. After a user has closed it, it stays closed until the next run."""

    def __init__(self, ui: Ui) -> None:
        """Add the dock, empty and hidden."""
        self._name, self._run = uuid.uuid4().hex, 0
        self._sheet: Sheet | None = None
        self._visible = False
        with add_hidden(ui, self._name):
            self._message = ui.gui.add_html(Markup(""))

    def begin(self) -> None:
        """Start a new run, which is shown even if the one before was closed."""
        self._run += 1

    def load(self, sheet: Sheet | None) -> None:
        """Show another sheet; None hides the dock."""
        if sheet is not None or self._sheet is not None:
            self._sheet = sheet
            self._send()

    def show(self, visible: bool) -> None:
        """Show or hide the dock."""
        if visible != self._visible:
            self._visible = visible
            self._send()

    def _send(self) -> None:
        sheet = self._sheet if self._visible else None
        content: dict[str, object] = {"dock": self._name, "run": self._run, "visible": sheet is not None}
        if sheet is not None:
            content |= {"title": sheet.title, "legend": sheet.legend, "table": sheet.table}
            content["figures"] = _figures(sheet.figures)
        self._message.content = page_call("plots", content)


def _figures(figures: Sequence[go.Figure]) -> list[object]:
    return [json.loads(figure.to_json()) for figure in figures]
