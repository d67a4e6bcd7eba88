"""The row of steps on top of the panel: where you are, what is done, what is out of date."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

from app.compute.state import StepStatus
from app.drawing.colors import BACKGROUND, BRAND, DELIVERED, LOSS, css
from app.web.markup import Markup
from app.window.gui import Gui

MARKS: dict[StepStatus, str] = {"fresh": "✓", "stale": "↻", "running": "…", "failed": "✗", "missing": ""}
COLORS: dict[StepStatus, str] = {
    "fresh": css(DELIVERED),
    "stale": "#b26a00",
    "running": css(BRAND),
    "failed": css(LOSS),
    "missing": "#868e96",
}
_BUTTON = Markup("div:has(> .packetmesh-steps) + div button:nth-of-type({}) {{ border-color: {}; {} }}")
_MARK = Markup(
    "div:has(> .packetmesh-steps) + div button:nth-of-type({}) .mantine-Button-label::after "
    "{{ content: '\\00a0{}' }}"
)
"""The marks are the style's, so that the buttons stay the same while a hand is on one."""


class Stepper:
    """Buttons, one for each step; the current one is filled."""

    def __init__(self, gui: Gui, titles: Sequence[str], on_pick: Callable[[str], None]) -> None:
        self._titles = tuple(titles)
        self._style = gui.add_html(Markup(""))
        self._buttons = gui.add_button_group("Steps", self._titles)
        self._buttons.on_click(lambda event: on_pick(event.target.value))

    def show(self, current: str, statuses: Mapping[str, StepStatus]) -> None:
        """Mark the current step and the state of all."""
        self._style.content = _style(self._titles.index(current), [statuses.get(t) for t in self._titles])


def _style(current: int, statuses: Sequence[StepStatus | None]) -> Markup:
    """CSS for the buttons that follow this element: their colours; ``page.css`` has their place."""
    rules = [Markup("canvas[data-engine] {{ background: {} }}").format(css(BACKGROUND))]
    for number, status in enumerate(statuses, 1):
        color = COLORS[status] if status is not None else css(BRAND)
        look = f"background: {color}; color: white;" if number == current + 1 else f"color: {color};"
        rules.append(_BUTTON.format(number, color, look))
        if status is not None and MARKS[status]:
            rules.append(_MARK.format(number, MARKS[status]))
    return Markup('<style class="packetmesh-steps">{}</style>').format(Markup(" ").join(rules))
