"""The place in a page through which a dock at the lower edge speaks with the server."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from app.web.markup import Markup
from app.window.ui import Ui


@contextmanager
def add_hidden(ui: Ui, name: str, call: Markup | None = None) -> Iterator[None]:
    """A container for controls that nobody sees.

    It is a panel of its own so that it stays when the control panel is closed.

    Args:
        ui: of the browser.
        name: by which the page's side finds it.
        call: what the page is to do first.
    """
    panel = ui.gui.add_panel()
    panel.float(x=0, y=0)
    panel.expand()
    with panel.add_tab("Dock"):
        mark = Markup('<span class="packetmesh-dock" data-dock="{}"></span>').format(name)
        ui.gui.add_html(mark + (call or ""))
        yield
