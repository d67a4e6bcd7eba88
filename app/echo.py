"""How the server learns that a browser has drawn what it was sent."""

from __future__ import annotations

from collections.abc import Callable

import viser

from app.delay import Delay

LABEL = "drawn"
PATIENCE_S = 1.0
"""Without an answer for so long, for want of a browser perhaps, it is taken as given."""
_ANSWER = (
    "const button = [...document.querySelectorAll('button')].find(b => b.textContent === this.dataset.label);"
    "button.style.display = 'none';"
    "requestAnimationFrame(() => requestAnimationFrame(() => button.click()))"
)
"""Presses the hidden button two frames later, as HTML cannot talk to the server by itself."""


class Echo:
    """Asks the browser to answer once it has drawn everything sent so far.

    A hand can move a slider faster than a slow browser draws. Without an answer to wait for, what is
    sent would queue up there and the picture would lag farther and farther behind the hand.
    """

    def __init__(self, gui: viser.GuiApi, post: Callable[..., None], on_answer: Callable[[], None]) -> None:
        """Add the hidden parts, best in a folder that is closed.

        Args:
            gui: where to add them.
            post: runs a function on the session's thread.
            on_answer: called there, once for each question.
        """
        self._on_answer = on_answer
        self._asked = 0
        self.waiting = False
        self._html = gui.add_html("")
        gui.add_button(LABEL).on_click(lambda _: post(self._answered))
        self._patience = Delay(PATIENCE_S, lambda: post(self._answered))

    def ask(self) -> None:
        """Ask now; of two questions, only the last is answered."""
        self._asked += 1
        self.waiting = True
        self._html.content = (
            f'<img alt="" style="display: none" src="data:," data-label="{LABEL}" '
            f'data-asked="{self._asked}" onerror="{_ANSWER}">'
        )
        self._patience.restart()

    def close(self) -> None:
        """End the timer."""
        self._patience.cancel()

    def _answered(self) -> None:
        if self.waiting:
            self.waiting = False
            self._patience.cancel()
            self._on_answer()
