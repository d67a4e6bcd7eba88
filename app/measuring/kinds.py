"""Kinds of measures: their labels, and what each click of them marks."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:
    from pipeline.measuring.marks import Snap
    from pipeline.measuring.measures import Kind

KINDS: Mapping[str, Kind] = {
    "Distance": "distance",
    "Point to plane": "point-plane",
    "Plane to plane": "plane-plane",
    "Angle": "angle",
    "Hole": "hole",
    "Box": "box",
}
"""Kinds by their labels."""
SNAPS: Mapping[str, Snap] = {"Surface": "surface", "Vertex": "vertex", "Edge": "edge", "Plane": "plane"}
KIND_NAMES = {kind: label for label, kind in KINDS.items()}
SNAP_NAMES = {snap: label for label, snap in SNAPS.items()}


@dataclass(frozen=True, slots=True)
class Step:
    """One click of a measure."""

    marks: Literal["point", "plane", "rim", "part"]
    """What the click marks: a point that snaps, a plane, the rim of a hole, or an object on a plane."""
    prompt: str


_PLANES = tuple(Step("plane", f"Click the {which} plane.") for which in ("first", "second", "third"))
_STEPS: Mapping[Kind, tuple[Step, ...]] = {
    "distance": (Step("point", "Click the first end."), Step("point", "Click the second end.")),
    "point-plane": (Step("point", "Click the point."), Step("plane", "Click the plane.")),
    "plane-plane": _PLANES[:2],
    "angle": (
        Step("point", "Click the first end."),
        Step("point", "Click the corner."),
        Step("point", "Click the second end."),
    ),
    "hole": (Step("rim", "Click a hole or its rim."),),
    "box": (Step("part", "Click an object that stands on a plane."),),
}
_OF_PLANES: Mapping[Kind, tuple[Step, ...]] = {"angle": _PLANES[:2], "box": _PLANES}
"""Clicks of the kinds that *Snap to: Plane* turns into measures between planes."""
FEW: Mapping[Kind, str] = {
    "box": "Intervals of boxes are hardly judged.",
    "hole": "Intervals of holes are hardly judged.",
}
"""Sentences on kinds of which few were compared with the truth (``pipeline.measuring.values.HELD``)."""
SNAPPED: Mapping[Kind, str] = {
    "angle": "With Snap to: Plane, two planes give their angle.",
    "box": "With Snap to: Plane, three faces of the object give its size.",
}
"""Sentences on what *Snap to: Plane* changes, by kind."""


def steps_of(kind: Kind, snap: Snap) -> tuple[Step, ...]:
    """Return the clicks that a measure takes."""
    return _OF_PLANES.get(kind, _STEPS[kind]) if snap == "plane" else _STEPS[kind]
