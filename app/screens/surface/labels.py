"""Labels of the Surface screen and of its lesson."""

from __future__ import annotations

from app.compute.records import Shown
from app.screens.surface.view import BaselineName, Coloring
from app.web.markup import Markdown
from pipeline.config import RadiusRule

TEXT = Markdown(
    """**What you see.** A ball rolls over the points and leaves a triangle wherever it rests on three.
Too small, and it falls through between the points; too large, and it skips detail. Red lines are the rims
of holes. Drag the radius, and compare before and after fusion. Go on with **Export**."""
)
AFTER, BEFORE, BOTH = "after fusion", "before fusion (sensor only)", "side by side"
POISSON, ALPHA = "Poisson, a baseline", "alpha shape, a baseline"
BASELINES: dict[str, BaselineName] = {POISSON: "poisson", ALPHA: "alpha"}
BASELINE_HEADS: dict[BaselineName, str] = {"poisson": "Poisson", "alpha": "alpha shape"}
OWN_COLORS = "Colours cannot be chosen: a baseline makes vertices of its own, of which no point is known."
SHOWN: dict[str, Shown] = {AFTER: "after", BEFORE: "before", BOTH: "after", **BASELINES}
"""Which surface is drawn, and so exported; of two side by side the one after fusion."""
PLACES = {"after": AFTER, "before": BEFORE, "both": BOTH, "poisson": POISSON, "alpha": ALPHA}
"""The same in the address."""
COLORINGS: dict[str, Coloring] = {
    "photographs": "photo",
    "inferred in violet (on photographs)": "violet",
    "the points' colours": "color",
    "source: sensor or inferred": "source",
    "distance to the truth": "distance",
    "normal": "normal",
}
"""What the colours of a surface mean."""
RULES: dict[str, RadiusRule] = {
    "r_F + {0, 1, 2, 4} σ_D": "thesis+",
    "thesis: r_F + {0, ¼, ½, 1} σ_D": "thesis",
    "one radius (slider)": "manual",
}
"""Which balls roll."""
NAMES: dict[Shown, str] = {
    "after": "After fusion",
    "before": "Before fusion",
    "poisson": "Poisson surface",
    "alpha": "Alpha shape",
}
"""What a surface is called where it is taken along."""
HINTS = {
    "Radii": "r_F and σ_D: mean and standard deviation of the distance to the nearest neighbour in the fused "
    "cloud. Several balls roll one after the other, the small ones first.",
    "Show": "Which surface is drawn: the ball's, or that of another method over the same points.",
    "Colours": "What the colours of the surface mean.",
}
