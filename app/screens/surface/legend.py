"""What the colours of a surface mean, as a line of HTML."""

from __future__ import annotations

from app.drawing.colors import DISTANCE_STOPS, INFERRED, MOST_DISTANCE_M, NEUTRAL, TARGET, css
from app.screens.surface.view import Coloring

_BOX = "display: inline-block; width: 0.9em; height: 0.9em; vertical-align: -0.1em; margin-right: 0.3em"


def legend_html(coloring: Coloring, has_truth: bool) -> str:
    """Empty for the camera's own colours."""
    if coloring == "color":
        return ""
    if coloring == "source":
        text = f"{_box(TARGET)}measured by a sensor &emsp; {_box(INFERRED)}inferred by the network"
    elif coloring == "normal":
        text = "Red, green and blue are the x, y and z of the normal; floors are light blue (z up)."
    elif not has_truth:
        text = f"{_box(NEUTRAL)}The truth of this scene is not known, so there is no distance to show."
    else:
        stops = ", ".join(css(stop) for stop in DISTANCE_STOPS)
        bar = f"height: 0.7em; background: linear-gradient(to right, {stops}); border-radius: 2px"
        ends = f"<span>on the truth</span><span>{100 * MOST_DISTANCE_M / 2:.0f} cm</span>"
        ends += f"<span>{100 * MOST_DISTANCE_M:.0f} cm or more</span>"
        row = "display: flex; justify-content: space-between"
        text = f'<div style="{bar}"></div><div style="{row}">{ends}</div>'
    return f'<div style="padding: 0 0.8em; font-size: 13px">{text}</div>'


def _box(color: tuple[int, int, int]) -> str:
    return f'<span style="{_BOX}; background: {css(color)}"></span>'
