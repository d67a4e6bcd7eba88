"""Keys pressed on a slider move the slider alone."""

from __future__ import annotations

import viser

_LISTEN = (
    "document.body.onkeydown = event => event.target.closest('[role=slider]') && event.stopPropagation()"
)
"""viser turns the view by arrow keys, too, unless the keys go to a text field; a slider is none."""


def keep_keys_from_the_view(gui: viser.GuiApi) -> None:
    """Add the hidden part that sees to it; HTML cannot hold a script, but what it does without its image."""
    gui.add_html(f'<img alt="" style="display: none" src="data:," onerror="{_LISTEN}">')
