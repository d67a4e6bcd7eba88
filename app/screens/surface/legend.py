"""What the colours of a surface mean, as a line of HTML."""

from __future__ import annotations

from app.drawing.colors import DISTANCE_STOPS, INFERRED, MOST_DISTANCE_M, NEUTRAL, TARGET, css
from app.records import ColorBar
from app.screens.surface.view import Coloring
from app.tables import bar_html
from pipeline.texture import SEAM_M

_BOX = "display: inline-block; width: 0.9em; height: 0.9em; vertical-align: -0.1em; margin-right: 0.3em"


def legend_html(coloring: Coloring, has_truth: bool) -> str:
    """What the colours mean, and those of the points that the ball left out."""
    dots = f"Points the ball left out: {_box(TARGET)}measured &ensp; {_box(INFERRED)}inferred"
    lines = [line for line in (_surface_html(coloring, has_truth), dots) if line]
    if coloring in ("photo", "violet"):
        lines.append(f"Holes of up to {100 * SEAM_M:.0f} cm around are closed here, not in the numbers.")
    return "".join(f'<div style="padding: 0 0.8em; font-size: 13px">{line}</div>' for line in lines)


def _surface_html(coloring: Coloring, has_truth: bool) -> str:
    """Empty for the cameras' own colours."""
    if coloring in ("photo", "color"):
        return ""
    if coloring == "violet":
        return f"{_box(INFERRED)}inferred by the network; all else was measured by a sensor"
    if coloring == "source":
        return f"{_box(TARGET)}measured by a sensor &emsp; {_box(INFERRED)}inferred by the network"
    if coloring == "normal":
        return "Red, green and blue are the x, y and z of the normal; floors are light blue (z up)."
    if not has_truth:
        return f"{_box(NEUTRAL)}The truth of this scene is not known, so there is no distance to show."
    half, most = (f"{100 * share * MOST_DISTANCE_M:.0f} cm" for share in (0.5, 1.0))
    return bar_html(ColorBar(DISTANCE_STOPS, ("on the truth", half, f"{most} or more")))


def _box(color: tuple[int, int, int]) -> str:
    return f'<span style="{_BOX}; background: {css(color)}"></span>'
