"""The row of steps on top of the panel: where you are, what is done, what is out of date."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import viser

from app.drawing.colors import BACKGROUND, BRAND, DELIVERED, LOSS, css
from app.state import StepStatus

MARKS: dict[StepStatus, str] = {"fresh": "✓", "stale": "↻", "running": "…", "failed": "✗", "missing": ""}
COLORS: dict[StepStatus, str] = {
    "fresh": css(DELIVERED),
    "stale": "#b26a00",
    "running": css(BRAND),
    "failed": css(LOSS),
    "missing": "#868e96",
}


class Stepper:
    """Buttons, one for each step; the current one is filled."""

    def __init__(self, gui: viser.GuiApi, titles: Sequence[str], on_pick: Callable[[str], None]) -> None:
        self._titles = tuple(titles)
        self._labels = self._titles
        self._style = gui.add_html("")
        self._buttons = gui.add_button_group("Steps", self._labels)
        self._buttons.on_click(lambda event: on_pick(self._title_of(event.target.value)))

    def _title_of(self, label: str) -> str:
        """The step of a label, whatever its mark: it may have changed since the click."""
        return next(title for title in self._titles if label.split(" ")[0] == title)

    def show(self, current: str, statuses: Mapping[str, StepStatus]) -> None:
        """Mark the current step and the state of all."""
        labels = tuple(
            f"{title} {MARKS[statuses[title]]}".rstrip() if title in statuses else title
            for title in self._titles
        )
        if labels != self._labels:
            self._labels = labels
            self._buttons.options = labels
        self._style.content = _style(self._titles.index(current), [statuses.get(t) for t in self._titles])


def _style(current: int, statuses: Sequence[StepStatus | None]) -> str:
    """CSS for the buttons that follow this element: their colours; ``page.css`` has their place."""
    row = "div:has(> .packetmesh-steps) + div"
    rules = [f"canvas[data-engine] {{ background: {css(BACKGROUND)} }}"]
    for index, status in enumerate(statuses):
        color = COLORS[status] if status is not None else css(BRAND)
        look = f"background: {color}; color: white;" if index == current else f"color: {color};"
        rules.append(f"{row} button:nth-of-type({index + 1}) {{ border-color: {color}; {look} }}")
    return f'<style class="packetmesh-steps">{" ".join(rules)}</style>'
