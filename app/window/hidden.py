"""A hidden panel in the page, through which a dock at the lower edge exchanges data with the server."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from app.web.markup import Markup
from app.window.ui import Ui


@contextmanager
def add_hidden(ui: Ui, name: str, call: Markup | None = None) -> Iterator[None]:
    """Open a container for hidden controls.

    It is a panel of its own so that it stays when the control panel is closed.

    Args:
        ui: the browser's panel.
        name: name by which the page's script finds it.
        call: page call that runs when the panel appears.
    """
    panel = ui.gui.add_panel()
    panel.float(x=0, y=0)
    panel.expand()
    with panel.add_tab("Dock"):
        mark = Markup('<span class="packetmesh-dock" data-dock="{}"></span>').format(name)
        ui.gui.add_html(mark + (call or ""))
        yield
