"""How the server learns that a browser has drawn what it was sent."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from app.web.markup import Markup
from app.window.page import page_call
from app.window.ui import Ui

TIMEOUT_S = 4.0
"""Without an answer for so long, perhaps as there is no browser, it is taken as given. A page that draws
answers within three seconds (page.js)."""


class DrawAcknowledgement:
    """Asks the browser to answer once it has drawn everything sent so far.

    A hand can move a slider faster than a slow browser draws. Without an answer to wait for, what is
    sent would queue up there and the picture would lag farther and farther behind the hand.

    The answer is a command, not a button: of all that is pressed and moved in the panel within 50 ms,
    viser sends only the last, so that a button would get lost beside a slider, and now and then the
    slider beside the button.
    """

    def __init__(self, ui: Ui, on_answer: Callable[[], None]) -> None:
        """Add the hidden parts; ``on_answer`` is called on the session's thread, once for each question."""
        self._on_answer = on_answer
        self._calls = 0
        self.waiting = False
        self._html = ui.gui.add_html(Markup(""))
        command = ui.gui.add_command("Say that all is drawn", hotkey="insert", modifier="cmd/ctrl+alt+shift")
        command.on_trigger(lambda _: ui.post(self._answered))
        self._timeout = ui.debounce(TIMEOUT_S, self._answered)

    def hold(self) -> None:
        """Have only new meshes drawn, until ``ask`` ends that, a hand turns the view, or 6 s have passed."""
        self._call("hold")

    def ask(self, vertices: Sequence[int] = (), hold: bool = False) -> None:
        """Ask now; of two questions, only the last is answered.

        Args:
            vertices: of each mesh that is to be drawn first. While they are awaited nothing is drawn,
                so that what they replace may be hidden at once.
            hold: whether to hold the view from now on.
        """
        self.waiting = True
        self._call("ask", list(vertices), hold)
        self._timeout.restart()

    def _call(self, function: str, *arguments: object) -> None:
        self._calls += 1
        self._html.content = page_call(function, *arguments, mark=self._calls)

    def _answered(self) -> None:
        if self.waiting:
            self.waiting = False
            self._timeout.cancel()
            self._on_answer()
