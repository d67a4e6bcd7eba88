"""The row of step buttons at the top of the panel: the current step, and each step's status."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

from app.compute.state import StepStatus
from app.drawing.colors import BACKGROUND, BRAND, css
from app.web.markup import Markup
from app.window.gui import Gui

MARKS: dict[StepStatus, str] = {"fresh": "✓", "stale": "↻", "running": "…", "failed": "✗", "missing": ""}
COLORS: dict[StepStatus, str] = {
    "fresh": "#00775a",
    "stale": "#a05f00",
    "running": css(BRAND),
    "failed": "#b54e00",
    "missing": "#5f6870",
}
"""Colours of text on white and under white text: the contrast is at least 4.5 (WCAG 2.2, 1.4.3)."""
_BUTTON = Markup("div:has(> .packetmesh-steps) + div button:nth-of-type({}) {{ border-color: {}; {} }}")
_MARK = Markup(
    "div:has(> .packetmesh-steps) + div button:nth-of-type({}) .mantine-Button-label::after "
    "{{ content: '\\00a0{}' }}"
)
"""CSS draws the marks, because a button with a new label would be replaced while it is clicked."""


class Stepper:
    """One button per step; the current one is filled."""

    def __init__(self, gui: Gui, titles: Sequence[str], on_pick: Callable[[str], None]) -> None:
        self._titles = tuple(titles)
        self._style = gui.add_html(Markup(""))
        self._buttons = gui.add_button_group("Steps", self._titles)
        self._buttons.on_click(lambda event: on_pick(event.target.value))

    def show(self, current: str, statuses: Mapping[str, StepStatus]) -> None:
        """Mark the current step and the status of each."""
        self._style.content = _style(self._titles.index(current), [statuses.get(t) for t in self._titles])


def _style(current: int, statuses: Sequence[StepStatus | None]) -> Markup:
    """Return CSS: the stage's background, and the buttons' colours and marks; ``page.css`` places them."""
    rules = [Markup("canvas[data-engine] {{ background: {} }}").format(css(BACKGROUND))]
    for number, status in enumerate(statuses, 1):
        color = COLORS[status] if status is not None else css(BRAND)
        look = f"background: {color}; color: white;" if number == current + 1 else f"color: {color};"
        rules.append(_BUTTON.format(number, color, look))
        if status is not None and MARKS[status]:
            rules.append(_MARK.format(number, MARKS[status]))
    return Markup('<style class="packetmesh-steps">{}</style>').format(Markup(" ").join(rules))
