"""Labels of the choices of a race, in the panel and in the lessons."""

from __future__ import annotations

from typing import get_args

from app.screens.fuse.view import RaceMode, Reference, Rival
from pipeline.config import Direction, Method, Metric

MODES: dict[str, RaceMode] = {"node on node": "nodes", "inferred on sensor": "inferred"}
DIRECTIONS: dict[str, Direction] = {
    "source asks target": "q2p",
    "target asks source": "p2q",
    "both": "both",
}
OFF_FROM: dict[Reference, str] = {
    "truth": "from the truth",
    "pixels": "from where its own pixels are",
    "cloud": "to the nearest point",
}
"""What the distance is that a race shows."""
STARTS: dict[str, tuple[float, float]] = {
    "aligned": (0.0, 0.0),
    "slightly off (3°, 6 cm)": (3.0, 6.0),
    "far off (20°, 40 cm)": (20.0, 40.0),
}
"""Start errors to choose from: degrees, centimetres."""
BY_HAND = "by hand"
RIVALS: dict[str, Rival] = {
    f"{method.upper()}, {metric}": (method, metric)
    for method in get_args(Method)
    for metric in get_args(Metric)
}
RIVAL_NAMES = {rival: name for name, rival in RIVALS.items()}
COMPARISONS: dict[str, tuple[Rival, ...]] = {
    "ICP or CEICP": (("icp", "point"), ("ceicp-a", "point")),
    "Point or plane": (("icp", "point"), ("icp", "plane")),
    "All four": (("icp", "point"), ("ceicp-a", "point"), ("icp", "plane"), ("ceicp-a", "plane")),
}
"""Races that tell apart what the weights do, what the metric does, and both."""
NOBODY = "none"
MOST_LANES = 4
MARKS = "①②③④"
"""Of the lanes."""
