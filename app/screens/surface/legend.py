"""What the colours of a surface mean, as a line of HTML."""

from __future__ import annotations

from app.drawing.colors import DISTANCE_STOPS, INFERRED, MOST_DISTANCE_M, NEUTRAL, TARGET, css
from app.records import ColorBar
from app.screens.surface.labels import OWN_COLORS
from app.screens.surface.view import Coloring
from app.tables import bar_html

_BOX = "display: inline-block; width: 0.9em; height: 0.9em; vertical-align: -0.1em; margin-right: 0.3em"


def legend_html(coloring: Coloring, has_truth: bool, baseline: bool = False) -> str:
    """Empty for the cameras' own colours; of a baseline why it has others."""
    if baseline:
        text = OWN_COLORS
    elif coloring in ("photo", "color"):
        return ""
    elif coloring == "violet":
        text = f"{_box(INFERRED)}inferred by the network; all else was measured by a sensor"
    elif coloring == "source":
        text = f"{_box(TARGET)}measured by a sensor &emsp; {_box(INFERRED)}inferred by the network"
    elif coloring == "normal":
        text = "Red, green and blue are the x, y and z of the normal; floors are light blue (z up)."
    elif not has_truth:
        text = f"{_box(NEUTRAL)}The truth of this scene is not known, so there is no distance to show."
    else:
        half, most = (f"{100 * share * MOST_DISTANCE_M:.0f} cm" for share in (0.5, 1.0))
        text = bar_html(ColorBar(DISTANCE_STOPS, ("on the truth", half, f"{most} or more")))
    return f'<div style="padding: 0 0.8em; font-size: 13px">{text}</div>'


def _box(color: tuple[int, int, int]) -> str:
    return f'<span style="{_BOX}; background: {css(color)}"></span>'
