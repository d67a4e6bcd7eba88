"""Labels of the Surface screen and of its lesson."""

from __future__ import annotations

from app.compute.records import ColorBar, Shown
from app.drawing.colors import DISTANCE_STOPS, INFERRED, MOST_DISTANCE_M, NEUTRAL, TARGET, css
from app.drawing.legend import Legend
from app.screens.surface.view import BaselineName, Coloring
from app.web.markup import Markdown, Markup
from app.window.tables import bar_html
from pipeline.config import RadiusRule
from pipeline.surface.findings import SEAM_M

TEXT = Markdown(
    """**What you see.** A ball rolls over the points and leaves a triangle wherever it rests on three. A
ball that is too small falls through between the points; one that is too large skips detail. Red lines are
the rims of holes. Drag the radius, and compare before and after fusion. Go on with **Export**."""
)
AFTER, BEFORE, BOTH = "after fusion", "before fusion (sensor only)", "side by side"
POISSON, ALPHA = "Poisson, a baseline", "alpha shape, a baseline"
BASELINES: dict[str, BaselineName] = {POISSON: "poisson", ALPHA: "alpha"}
BASELINE_HEADS: dict[BaselineName, str] = {"poisson": "Poisson", "alpha": "alpha shape"}
OWN_COLORS = (
    "A baseline has no choice of colours: its vertices are new, and no point of the cloud belongs to them."
)
SHOWN: dict[str, Shown] = {AFTER: "after", BEFORE: "before", BOTH: "after", **BASELINES}
"""The surface that is drawn and exported; of two side by side, the one after fusion."""
PLACES = {"after": AFTER, "before": BEFORE, "both": BOTH, "poisson": POISSON, "alpha": ALPHA}
"""The surfaces' names in the address."""
COLORINGS: dict[str, Coloring] = {
    "photographs": "photo",
    "inferred in violet (on photographs)": "violet",
    "the points' colours": "color",
    "source: sensor or inferred": "source",
    "distance to the truth": "distance",
    "normal": "normal",
}
"""Colourings of a surface."""
RULES: dict[str, RadiusRule] = {
    "r_F + {0, 1, 2, 4} σ_D": "thesis+",
    "thesis: r_F + {0, ¼, ½, 1} σ_D": "thesis",
    "one radius (slider)": "manual",
}
"""Rules for the radii of the balls."""
COLORING_NAMES = {key: name for name, key in COLORINGS.items()}
RULE_NAMES = {rule: name for name, rule in RULES.items()}
NAMES: dict[Shown, str] = {
    "after": "After fusion",
    "before": "Before fusion",
    "poisson": "Poisson surface",
    "alpha": "Alpha shape",
}
"""Names of the surfaces in exported files."""
HINTS = {
    "Radius": "Radius of the ball; drag to roll another.",
    "Radii": "r_F and σ_D: mean and standard deviation of the distance to the nearest neighbour in the fused "
    "cloud. Several balls roll one after the other, the small ones first.",
    "Show": "Surface that is drawn: the ball's, or that of another method from the same points.",
    "Colours": "Meaning of the surface's colours.",
}


_BOX = "display: inline-block; width: 0.9em; height: 0.9em; vertical-align: -0.1em; margin-right: 0.3em"
CLOSED = (
    f"Holes whose rim is at most {100 * SEAM_M:.0f} cm long are closed in the picture, not in the numbers."
)
_INFERRED = ("inferred by the network", INFERRED)
_OWN: dict[Coloring, str] = {
    "photo": "The cameras' photographs; where no camera sees the surface, the colours of its points.",
    "color": "The colours that the cameras saw at the points.",
}


def legend_of(coloring: Coloring, has_truth: bool) -> Legend:
    """Return the legend of an export, which also explains the cameras' own colours."""
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
    """Return HTML of the legends of the surface and the left-out points, or of a baseline."""
    left_out = Legend("Points that the ball left out:", (("measured", TARGET), _INFERRED))
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
