"""HTML that adds the app's scripts and styles to viser's page and calls the page's functions.

Scripts and styles are files of the server. The content policy forbids scripts in HTML, so that no text from a
file can run as one. To call a function in the page, the server sends HTML with the function's name and
arguments, and ``page.js`` calls it.
"""

from __future__ import annotations

import json

from app.web.markup import Markup


def stale_html(numbers: bool, picture: bool) -> Markup:
    """Return HTML that dims the panel's numbers or the 3-D picture, through the style sheet."""
    marks = {"packetmesh-old-numbers": numbers, "packetmesh-old-picture": picture}
    found = (Markup('<i class="{}"></i>').format(mark) for mark, dimmed in marks.items() if dimmed)
    return Markup("").join(found)


def screen_mark(title: str) -> Markup:
    """Return HTML at the start of a screen that tells the page which screen is shown."""
    mark = Markup('<span data-packetmesh-screen="{}"></span>').format(title)
    return mark + page_call("shown", mark=title)


def page_call(function: str, *arguments: object, mark: object = "") -> Markup:
    """Return HTML that calls one of the page's functions each time it is shown.

    Args:
        function: its name in ``packetmesh.calls`` (``page.js``).
        arguments: JSON values; the function gets the HTML element first, then these.
        mark: makes otherwise equal calls differ, because a page takes the same HTML only once.
    """
    encoded = json.dumps(arguments, separators=(",", ":"))
    return Markup('<i hidden data-packetmesh-call="{}" data-arguments="{}" data-mark="{}"></i>').format(
        function, encoded, mark
    )
