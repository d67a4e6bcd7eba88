"""What the app adds to viser's page: scripts and style sheets of its own, ``PARTS``."""

from __future__ import annotations

from html import escape
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import viser

PARTS = ("page", "hint", "lesson")
_SCRIPT, _STYLE = (
    "".join(Path(__file__).with_name(name + kind).read_text(encoding="utf-8") for name in PARTS)
    for kind in (".js", ".css")
)


def add_script(gui: viser.GuiApi) -> None:
    """Have the page run the scripts, before they are first called, and take the style sheets."""
    gui.add_html(f"<style>{_STYLE}</style>{running(_SCRIPT)}")


def stale_html(numbers: bool, picture: bool) -> str:
    """HTML by which the style sheet dims the numbers of the panel, or the 3-D picture."""
    marks = {"packetmesh-old-numbers": numbers, "packetmesh-old-picture": picture}
    return "".join(f'<i class="{mark}"></i>' for mark, wanted in marks.items() if wanted)


def screen_mark(title: str) -> str:
    """HTML that begins a screen, by which the page knows that it is shown."""
    mark = f'<span data-packetmesh-screen="{escape(title)}"></span>'
    return mark + running("window.packetmesh?.shown()", title)


def running(script: str, mark: object = "") -> str:
    """HTML that runs a script when it is shown. It cannot hold one, but what is to be done without its image.

    Args:
        script: what to run.
        mark: tells two apart that are otherwise alike, as a page runs the same HTML once only.
    """
    return f'<img alt="" style="display: none" src="data:," data-mark="{mark}" onerror="{escape(script)}">'
