"""What the app adds to viser's page, and how the server has the page do something.

Its scripts and styles are files of the server. The content policy forbids scripts in HTML, so that no text
from a file can be one: to have the page do something, the server sends HTML with the name of a function and
its arguments, and ``page.js`` calls it.
"""

from __future__ import annotations

import json

from app.web.markup import Markup


def stale_html(numbers: bool, picture: bool) -> Markup:
    """HTML by which the style sheet dims the numbers of the panel, or the 3-D picture."""
    marks = {"packetmesh-old-numbers": numbers, "packetmesh-old-picture": picture}
    found = (Markup('<i class="{}"></i>').format(mark) for mark, wanted in marks.items() if wanted)
    return Markup("").join(found)


def screen_mark(title: str) -> Markup:
    """HTML that begins a screen, by which the page knows that it is shown."""
    mark = Markup('<span data-packetmesh-screen="{}"></span>').format(title)
    return mark + page_call("shown", mark=title)


def page_call(function: str, *arguments: object, mark: object = "") -> Markup:
    """Return HTML that has the page call one of its functions each time it is shown.

    Args:
        function: its name in ``packetmesh.calls`` (``page.js``).
        arguments: what JSON can hold; the function gets the element first, then these.
        mark: tells two calls apart that are otherwise alike, as a page takes the same HTML once only.
    """
    told = json.dumps(arguments, separators=(",", ":"))
    return Markup('<i hidden data-packetmesh-call="{}" data-arguments="{}" data-mark="{}"></i>').format(
        function, told, mark
    )
