"""The place in a page through which a dock at the lower edge speaks with the server."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from app.page import running
from app.ui import Ui

_SCRIPT, _STYLE = (
    Path(__file__).with_name(name).read_text(encoding="utf-8") for name in ("dock_row.js", "dock.css")
)


@contextmanager
def add_hidden(ui: Ui, name: str, script: str) -> Iterator[None]:
    """A container for controls that nobody sees.

    It is a panel of its own so that it stays when the control panel is closed.

    Args:
        ui: of the browser.
        name: by which the page's side finds it.
        script: the page's side.
    """
    panel = ui.gui.add_panel()
    panel.float(x=0, y=0)
    panel.expand()
    with panel.add_tab("Dock"):
        mark = f'<span class="packetmesh-dock" data-dock="{name}"></span>'
        ui.gui.add_html(f"{mark}<style>{_STYLE}</style>{running(_SCRIPT + script)}")
        yield
