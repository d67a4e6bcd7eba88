"""What the colours of a surface mean."""

from __future__ import annotations

from app.compute.records import ColorBar
from app.drawing.colors import DISTANCE_STOPS, INFERRED, MOST_DISTANCE_M, NEUTRAL, TARGET, css
from app.drawing.legend import Legend
from app.screens.surface.labels import OWN_COLORS
from app.screens.surface.view import Coloring
from app.web.markup import Markup
from app.window.tables import bar_html
from pipeline.surface.findings import SEAM_M

_BOX = "display: inline-block; width: 0.9em; height: 0.9em; vertical-align: -0.1em; margin-right: 0.3em"
CLOSED = f"Holes of up to {100 * SEAM_M:.0f} cm around are closed here, not in the numbers."
_INFERRED = ("inferred by the network", INFERRED)
_OWN: dict[Coloring, str] = {
    "photo": "The cameras' photographs; where none sees the surface, the colours of its points.",
    "color": "The colours that the cameras saw at the points.",
}


def legend_of(coloring: Coloring, has_truth: bool) -> Legend:
    """Of what is taken along, where the cameras' own colours are told, too."""
    if coloring in _OWN:
        return Legend(_OWN[coloring])
    if coloring == "violet":
        return Legend(swatches=((f"{_INFERRED[0]}; all else was measured by a sensor", INFERRED),))
    if coloring == "source":
        return Legend(swatches=(("measured by a sensor", TARGET), _INFERRED))
    if coloring == "normal":
        return Legend("Red, green and blue are the x, y and z of the normal; floors are light blue (z up).")
    if not has_truth:
        unknown = "The truth of this scene is not known, so there is no distance to show."
        return Legend(swatches=((unknown, NEUTRAL),))
    half, most = (f"{100 * share * MOST_DISTANCE_M:.0f} cm" for share in (0.5, 1.0))
    return Legend(bar=ColorBar(DISTANCE_STOPS, ("on the truth", half, f"{most} or more")))


def legend_html(coloring: Coloring, has_truth: bool, baseline: bool = False) -> Markup:
    """What the colours mean, of a baseline why it has others, and those of points that the ball left out."""
    left_out = Legend("Points the ball left out:", (("measured", TARGET), _INFERRED))
    surface = Legend() if coloring in _OWN else legend_of(coloring, has_truth)
    closed = Legend(CLOSED if coloring in ("photo", "violet") else "")
    legends = (Legend(OWN_COLORS),) if baseline else (surface, left_out, closed)
    lines = [_line(legend) for legend in legends if legend != Legend()]
    return Markup("").join(
        Markup('<div style="padding: 0 0.8em; font-size: 13px">{}</div>').format(line) for line in lines
    )


def _line(legend: Legend) -> Markup:
    if legend.bar is not None:
        return bar_html(legend.bar)
    boxes = (
        Markup('<span style="{}; background: {}"></span>{}').format(_BOX, css(color), text)
        for text, color in legend.swatches
    )
    return Markup(" &emsp; ").join(filter(None, (legend.text, *boxes)))
