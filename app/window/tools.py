"""The row of small buttons under the steps: find, undo, redo, views, fit, picture and full screen."""

from __future__ import annotations

from app.web.markup import Markup
from app.window.gui import Gui
from app.window.palette import KEYS, Name

_PATHS = {
    "find": "M3 10a7 7 0 1 0 14 0a7 7 0 1 0 -14 0M21 21l-6 -6",
    "undo": "M9 14l-4 -4l4 -4M5 10h11a4 4 0 1 1 0 8h-1",
    "redo": "M15 14l4 -4l-4 -4M19 10h-11a4 4 0 1 0 0 8h1",
    "views": "M12 3l8 4.5v9l-8 4.5l-8 -4.5v-9zM12 12l8 -4.5M12 12v9M12 12l-8 -4.5",
    "fit": "M4 8v-4h4M16 4h4v4M20 16v4h-4M8 20h-4v-4M9 9h6v6h-6z",
    "picture": "M5 7h2l2 -3h6l2 3h2a2 2 0 0 1 2 2v9a2 2 0 0 1 -2 2h-14a2 2 0 0 1 -2 -2v-9a2 2 0 0 1 2 -2"
    "M9 13a3 3 0 1 0 6 0a3 3 0 1 0 -6 0",
    "alone": "M14 4h6v6M20 4l-7 7M10 20h-6v-6M4 20l7 -7",
}
"""Outlines of the icons in a square of 24 units."""
_ICON = Markup(
    '<svg viewBox="0 0 24 24" width="17" height="17" fill="none" stroke="currentColor" stroke-width="1.9" '
    'stroke-linecap="round" stroke-linejoin="round" aria-hidden="true"><path d="{}"/></svg>'
)
_BUTTON = Markup('<button type="button" data-packetmesh-key="{}" title="{}" aria-label="{}"{}>{}</button>')
_FIND = Markup(
    '<button type="button" class="find" data-packetmesh-key="mod+k" title="Find a screen, setting, scene, '
    'lesson, term or view by typing. The list also shows all keys.">{}<span>Find …</span>'
    "<kbd></kbd></button>"
)
_VIEWS = Markup(
    '<button type="button" data-packetmesh-find="View" title="Views: from above, from a side, from a camera '
    'node" aria-label="Views">{}</button>'
)


class Tools:
    """The row of buttons; each presses the key of an entry of the palette (``palette.js``)."""

    def __init__(self, gui: Gui) -> None:
        """Add the row to the current container."""
        self._shown = (False, False)
        self._html = gui.add_html(row_html(*self._shown))

    def show(self, undo: bool, redo: bool) -> None:
        """Enable *Undo* and *Redo*, each if it has something to do."""
        if (undo, redo) != self._shown:
            self._shown = (undo, redo)
            self._html.content = row_html(undo, redo)


def row_html(undo: bool, redo: bool) -> Markup:
    """Return HTML of the row."""
    buttons = [
        _button("undo", "Undo the last change of a setting (Ctrl-Z)", undo),
        _button("redo", "Redo (Ctrl-Shift-Z or Ctrl-Y)", redo),
        _VIEWS.format(_icon("views")),
        _button("fit", "Fit the view to the window (V)"),
        _button("picture", "Picture of the view, at twice its size, as a PNG file (P)"),
        _button("alone", "Full screen: only the 3-D picture (M); Esc leaves it"),
    ]
    letters = "".join(key.name for key in KEYS.values() if key.modifier is None)
    return Markup('<div class="packetmesh-tools" data-letters="{}">{}{}</div>').format(
        letters, _FIND.format(_icon("find")), Markup("").join(buttons)
    )


def _icon(name: str) -> Markup:
    return _ICON.format(_PATHS[name])


def _button(name: Name, title: str, enabled: bool = True) -> Markup:
    key = KEYS[name].name
    return _BUTTON.format(key, title, title, Markup("") if enabled else Markup(" disabled"), _icon(name))
