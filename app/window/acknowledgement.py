"""Ask a browser to report that it has drawn everything it was sent."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from app.web.markup import Markup
from app.window.page import page_call
from app.window.ui import Ui

TIMEOUT_S = 4.0
"""Time after which a missing answer is taken as given, seconds; there may be no browser. A page that draws
answers within three seconds (page.js)."""


class DrawAcknowledgement:
    """Asks the browser to answer once it has drawn everything sent so far.

    A slider can change faster than a slow browser draws. Without waiting for an answer the server would fill
    the browser's queue, and the picture would lag more and more behind the slider.

    The answer is a command, not a button. Of all input to the panel within 50 ms viser sends only the last,
    so a button's answer could be lost next to a slider's, and sometimes the slider's next to the button's.
    """

    def __init__(self, ui: Ui, on_answer: Callable[[], None]) -> None:
        """Add the hidden controls. ``on_answer`` is called on the session's thread, once per question."""
        self._on_answer = on_answer
        self._calls = 0
        self._awaited: list[int] = []
        self.waiting = False
        self.held = False
        """Whether the page draws only new meshes, unless the user turns the view or 6 s have passed."""
        self._html = ui.gui.add_html(Markup(""))
        command = ui.gui.add_command("Say that all is drawn", hotkey="insert", modifier="cmd/ctrl+alt+shift")
        command.on_trigger(lambda _: ui.post(self._answered))
        self._timeout = ui.debounce(TIMEOUT_S, self._answered)

    def hold(self) -> None:
        """Let the page draw only new meshes until ``ask`` stops this; answered once it does."""
        self._call("hold")

    def ask(self, vertices: Sequence[int] = (), hold: bool = False) -> None:
        """Ask now; of two open questions, only the last is answered, when the meshes of both are drawn.

        Args:
            vertices: vertex counts of the meshes that must be drawn first.
            hold: whether the page draws only new meshes from now on, and nothing until all of ``vertices``
                have come, so that the meshes they replace can be hidden at once.
        """
        self._awaited += vertices
        self._call("ask", self._awaited, hold)  # viser may send the last of two questions only
        self.held = hold

    def _call(self, function: str, *arguments: object) -> None:
        self._calls += 1
        self.waiting = self.held = True
        self._html.content = page_call(function, *arguments, mark=self._calls)
        self._timeout.restart()

    def _answered(self) -> None:
        if self.waiting:
            self.waiting = False
            self._awaited = []
            self._timeout.cancel()
            self._on_answer()
