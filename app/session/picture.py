"""A picture of a browser's 3-D view at twice its size, with its scale bar if that is shown, as a PNG file."""

from __future__ import annotations

import re
import threading
from collections.abc import Callable

import cv2
import viser

from app.drawing.pictures import opaque
from app.session.scale_bar import BAR, ScaleBar, bar_of, draw_bar
from app.web.gate import MOST_VIEW_PX
from app.web.markup import Markup
from app.window.hidden import add_hidden
from app.window.page import page_call
from app.window.ui import Ui
from packetmesh.errors import InputError

TIMES = 2
"""The picture's size over the size of the view in the window."""
WAIT_S = 30.0
SIZE = re.compile(rf"\d{{1,9}} ([1-9]\d{{0,4}}) ([1-9]\d{{0,4}})(?: {BAR})?")
"""The page's answer: a number that makes equal answers differ, width and height of the view, CSS pixels, and
the scale bar over the view, if there is one.
"""


def size_of(text: str) -> tuple[int, int]:
    """Return width and height of the picture, pixels: twice the size of the view in the page's answer.

    Raises:
        InputError: the answer is not a size, or the picture would be too large.
    """
    found = SIZE.fullmatch(text)
    if found is None:
        raise InputError("The browser did not report the size of its view; reload the page and try again.")
    width_px, height_px = TIMES * int(found[1]), TIMES * int(found[2])
    if max(width_px, height_px) > MOST_VIEW_PX:
        raise InputError(
            f"The picture would have {width_px} x {height_px} pixels, more than {MOST_VIEW_PX}; make the "
            "window smaller."
        )
    return width_px, height_px


class ViewPicture:
    """Takes pictures of the view of one browser. A request during another one is ignored."""

    def __init__(self, ui: Ui, client: viser.ClientHandle, name: str, file: Callable[[], str]) -> None:
        """Add the hidden field for the page's answer.

        Args:
            ui: the browser's own controls.
            client: the browser.
            name: name by which the page finds the field.
            file: returns the name of the file, without its suffix.
        """
        self._ui, self._client, self._name, self._file = ui, client, name, file
        self._taking = threading.Lock()
        self._count = 0
        with add_hidden(ui, name):
            self._field = ui.when_changed(ui.gui.add_text("Size of the view", ""), self._answered)
            self._html = ui.gui.add_html(Markup(""))

    def take(self) -> None:
        """Ask the page for the size of its view, then take the picture."""
        self._count += 1
        self._html.content = page_call("measureView", self._name, mark=self._count)

    def _answered(self) -> None:
        """Have the browser draw. A thread of its own waits for the picture, which may take seconds."""
        size_px = size_of(self._field.value)
        bar = bar_of(self._field.value.split(" ", 3)[-1])
        if self._taking.acquire(blocking=False):
            threading.Thread(target=self._draw, args=(*size_px, bar, self._file()), daemon=True).start()

    def _draw(self, width_px: int, height_px: int, bar: ScaleBar | None, file: str) -> None:
        try:
            drawn = self._client.get_render(height_px, width_px, transport_format="png", timeout=WAIT_S)
            if drawn.shape != (height_px, width_px, 4):
                raise RuntimeError("another size")
            rgb = opaque(drawn)
            if bar is not None:
                draw_bar(rgb, bar, TIMES)
            png = cv2.imencode(".png", cv2.cvtColor(rgb, cv2.COLOR_RGB2BGR))[1].tobytes()
        except (RuntimeError, TimeoutError, OSError, ValueError):
            self._ui.post(_fail)
        else:
            self._client.send_file_download(f"{file}.png", png, save_immediately=True)
        finally:
            self._taking.release()


def _fail() -> None:
    """Report that no picture came.

    Raises:
        InputError: always; the session shows it.
    """
    raise InputError("The browser sent no picture of the view; try again, or make the window smaller.")
