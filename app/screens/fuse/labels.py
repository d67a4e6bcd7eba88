"""Labels of a race's choices, in the panel and in the lessons."""

from __future__ import annotations

from typing import get_args

from app.screens.fuse.view import RaceMode, Reference, Rival
from app.web.markup import Markdown
from app.window.controls import Choice
from pipeline.config import Direction, Method, Metric

MODES: dict[str, RaceMode] = {
    "node on node": "nodes",
    "inferred on sensor": "inferred",
    "corridor": "corridor",
    "square room": "square",
    "mirrored room": "mirrored",
}
DIRECTIONS: dict[str, Direction] = {
    "from source to target": "q2p",
    "from target to source": "p2q",
    "both": "both",
}
OFF_FROM: dict[Reference, str] = {
    "truth": "from the truth",
    "pixels": "from the measured points of its pixels",
    "walk": "from the poses of the whole walk",
    "cloud": "to the nearest point",
}
"""Meaning of the distance that a race shows."""
STARTS: dict[str, tuple[float, float]] = {
    "aligned": (0.0, 0.0),
    "slightly off (3°, 6 cm)": (3.0, 6.0),
    "far off (20°, 40 cm)": (20.0, 40.0),
}
"""Start errors to choose from: degrees, centimetres."""
SLIGHTLY = list(STARTS)[1]
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
"""Comparisons of weights, of metrics, and of both."""
NO_METHOD = "none"
DEGRADATIONS: dict[str, tuple[str, float, float, float, str]] = {
    "noise_m": ("Noise (cm)", 10.0, 0.5, 100.0, "Standard deviation of noise added along the view rays."),
    "outlier_share": (
        "Outliers (%)",
        60.0,
        5.0,
        100.0,
        "Share of the points that are replaced by random points in the cloud's bounding box.",
    ),
    "hole_share": ("Holes (%)", 80.0, 5.0, 100.0, "Share of points removed in round patches of the view."),
    "crop_share": (
        "Cut off (%)",
        80.0,
        5.0,
        100.0,
        "Share of points removed at one side; reduces the overlap.",
    ),
    "depth_bias": ("Bias (%)", 15.0, 0.5, 100.0, "RMS of a smooth relative error of the depth."),
}
"""By field of ``Race``: label, maximum, step, shown units per unit of the field, hint."""
UNDEGRADED = Markdown("A synthetic room's scan cannot be degraded: its scanner stood inside.")
MOST_LANES = 4
MOST_SEED = 20
MARKS = "①②③④"
"""Marks of the lanes."""
TEXT = Markdown(
    """**What you see.** Each lane registers the same cloud with the grey one, from the same start; colours
show the error of every point. Press **Play** below (space), and compare the methods."""
)
SINGLE = Markdown(
    """This scene has a single node, so there is no other cloud to register it with. Here its inferred cloud
races onto its measured cloud."""
)
MS = "ms"
RUNNING = Markdown("Which method ends nearer? The numbers appear here at the end of the race.")
RACES = {f"race: {name}": mode for name, mode in MODES.items()}
RACE_NAMES = {mode: name for name, mode in RACES.items()}
RESULT, BEFORE = "result", "before registration"
WALK = "the walk"
ADVANCED = (
    Choice(
        "Chain: method",
        "node_registration.method",
        {m: m.upper() for m in get_args(Method)},
        hint="Method that places the nodes in the chain (not in the race).",
    ),
    Choice("Chain: metric", "node_registration.metric"),
    Choice("Chain: points", "fusion.align_nodes_with"),
)
