"""Labels of the Surface screen and of its lesson."""

from __future__ import annotations

from typing import Literal

from app.records import Coloring
from pipeline.config import RadiusRule

AFTER, BEFORE, BOTH = "after fusion", "before fusion (sensor only)", "side by side"
POISSON, ALPHA = "Poisson, a baseline", "alpha shape, a baseline"
BASELINES: dict[str, Literal["poisson", "alpha"]] = {POISSON: "poisson", ALPHA: "alpha"}
SHOWN = (AFTER, BEFORE, BOTH, POISSON, ALPHA)
"""Which surface is drawn."""
COLORINGS: dict[str, Coloring] = {
    "the camera's colours": "color",
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
