"""The methods of a race: colour, description in two sentences, and source."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from app.screens.fuse.view import Rival

Color = tuple[int, int, int]

PLANE_SHADE = 0.55
"""Brightness of a method's colour with the plane metric: the same hue, darker."""
METRICS = {
    "point": "It minimises the distance to the paired point.",
    "plane": "It minimises the distance to the plane at the paired point, so surfaces may slide along "
    "themselves (Chen, Medioni 1992).",
}


@dataclass(frozen=True, slots=True)
class About:
    """Description of a method."""

    color: Color
    text: str
    """Two sentences on how it works."""
    source: str


_THESIS = "the thesis, eqs. 3.10-3.17"
METHODS: dict[str, About] = {
    "icp": About(
        (104, 112, 168),
        "Every point is paired with its nearest counterpart, and every pair counts the same. Pairs of points "
        "that have no counterpart pull the cloud aside.",
        "Besl, McKay, TPAMI 1992",
    ),
    "trimmed-icp": About(
        (170, 68, 153),
        "Only a fixed share of the closest pairs counts, all of them the same. The share must be known "
        "in advance.",
        "Chetverikov, Svirko, Stepanov, Krsek, ICPR 2002",
    ),
    "picp": About(
        (82, 60, 168),
        "It works from few points to many and keeps only the closest of all pairs that share a point. "
        "Pairs with a distance far above the usual one are left out.",
        "Zinsser, Schmidt, Niemann, ICIP 2003",
    ),
    "ricp": About(
        (150, 92, 20),
        "Motions of small random sets of pairs compete, and the one with the least median residual wins. "
        "The pairs that agree with it have equal weights, the others none.",
        "Trucco, Fusiello, Roberto, Pattern Recognition Letters 1999",
    ),
    "mricp": About(
        (184, 134, 11),
        "Plain ICP on few points of both clouds, then on more and more. This is fast, and small details "
        "mislead it less.",
        "Jost, Hügli, 3DIM 2003",
    ),
    "ficp": About(
        (204, 85, 110),
        "At every matching it chooses the share of the closest pairs again, by a residual that rewards "
        "keeping many. These have equal weights, the others none.",
        "Phillips, Liu, Tomasi, 3DIM 2007",
    ),
    "hicp": About(
        (210, 105, 50),
        "Pairs are nearest in position and hue together. Of these pairs only the closest share counts.",
        "Men, Gebre, Pochiraju, ICRA 2011",
    ),
    "ceicp-literal": About(
        (136, 34, 85),
        "Pairs weigh −f log f, with f a Gaussian density fitted to their distances, as printed in the "
        "thesis. A density has a unit, so the weights depend on the unit of length.",
        _THESIS,
    ),
    "ceicp-n": About(
        (42, 160, 160),
        "Pairs within a gate weigh −p log p, with p falling with their distance and adding up to one. The "
        "scale is estimated from the pairs at every iteration.",
        f"{_THESIS}, made free of units (SPEC 4.4)",
    ),
    "ceicp-a": About(
        (0, 158, 100),
        "Pairs weigh −p log p, with p falling with their distance and, with the plane metric, with the angle "
        "between their normals. The scale shrinks at every iteration, so far pairs soon cease to count.",
        f"{_THESIS}, made free of units; the shrinking scale and the normals are ours (SPEC 4.4, 4.11)",
    ),
    "ceicp-r": About(
        (128, 138, 40),
        "Pairs weigh −p log p, on a scale that follows the median of their distances. The scale never grows.",
        f"{_THESIS}, made free of units; the robust scale is ours (SPEC 4.4)",
    ),
    "ceicp-ml": About(
        (50, 145, 195),
        "Each point of the fixed cloud spreads its weight over its five nearest counterparts. This "
        "minimises the cross-entropy of the two clouds directly.",
        "Granger, Pennec, ECCV 2002; Myronenko, Song, TPAMI 2010",
    ),
    "kernel-correlation": About(
        (150, 110, 205),
        "Every point attracts its ten nearest counterparts, nearer ones more strongly. The scale shrinks "
        "at every iteration.",
        "Tsin, Kanade, ECCV 2004",
    ),
    "fast-robust-icp": About(
        (35, 85, 195),
        "Weights fall with the pairs' distance, on a scale that halves whenever the cloud has stopped "
        "moving. Steps are extrapolated; of all published methods it is the most similar to CEICP-A.",
        "Zhang, Yao, Deng, TPAMI 2021",
    ),
}
"""Descriptions by the method's name in the settings."""


def color_of(rival: Rival) -> Color:
    """Return the colour of a method with a metric, the same in every race."""
    method, metric = rival
    shade = PLANE_SHADE if metric == "plane" else 1.0
    red, green, blue = np.rint(np.multiply(METHODS[method].color, shade)).astype(int).tolist()
    return (red, green, blue)


def label_of(rival: Rival) -> str:
    """Return the label of a method with a metric."""
    return f"{rival[0].upper()} {rival[1]}"
