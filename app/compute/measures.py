"""Measures that a person takes on a surface by clicks, and their results, small enough to send."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, TypeAlias

from app.compute.cuts import Cut
from pipeline.types import FloatArray

if TYPE_CHECKING:
    from pipeline.measuring.marks import Snap
    from pipeline.measuring.measures import Kind, Unit

Place: TypeAlias = tuple[float, float, float]
"""A point in the world frame, metres, rounded to millimetres as it is in the address."""


@dataclass(frozen=True, slots=True)
class Taken:
    """A measure as it was clicked; its numbers follow from the surface."""

    kind: Kind
    snap: Snap
    points_m: tuple[Place, ...]
    """Clicked points, before they are snapped."""
    part: int = 0
    """Index of the surface that was clicked, where there are several."""
    name: str = ""
    """Name that a person gave it; empty for its number."""

    @property
    def unnamed(self) -> Taken:
        """The measure without its name, on which its numbers do not depend."""
        return replace(self, name="")


@dataclass(frozen=True, slots=True)
class Scale:
    """A measure whose true length is known, by which all lengths are scaled."""

    by: Taken
    """The measure, without its name."""
    true_m: float


@dataclass(frozen=True, slots=True)
class Tape:
    """The list of measures, and the scale that was set by one of them."""

    taken: tuple[Taken, ...] = ()
    scale: Scale | None = None


NO_MEASURES = Tape()


@dataclass(frozen=True, slots=True)
class Click:
    """A click's ray in the frame of the surface."""

    origin_m: Place
    direction: Place
    cut: Cut = None
    """The cut, in the same frame; the part of the surface that it leaves out cannot be clicked."""


@dataclass(frozen=True, slots=True)
class Clicked:
    """The points of a measure that is not complete."""

    kind: Kind
    snap: Snap
    points_m: tuple[Place, ...] = ()
    part: int = 0


@dataclass(frozen=True, slots=True)
class MeasureRequest:
    """Measures to compute, and clicks to turn into points."""

    wanted: tuple[Taken, ...]
    pending: Clicked
    clicks: tuple[Click, ...] = ()
    scale: Scale | None = None
    check: Scale | None = None
    """A typed true length to compare with its measure, without scaling by it."""


@dataclass(frozen=True, slots=True)
class Quantity:
    """A number with its 95 % interval."""

    name: str
    value: float
    unit: Unit
    low: float
    high: float
    guessed: bool
    """Whether an end was guessed, as in ``pipeline.measuring.values.Value``."""


@dataclass(frozen=True, slots=True)
class End:
    """A point of a measure as it is drawn."""

    point_m: FloatArray
    """(3,) after snapping."""
    normal: FloatArray
    """(3,) unit, towards the observer."""
    guessed: bool


@dataclass(frozen=True, slots=True)
class Face:
    """A plane of a measure as it is drawn."""

    corners_m: FloatArray
    """(4, 3) in order around the part of the surface to which it was fitted."""
    normal: FloatArray
    """(3,) unit normal."""
    guessed: bool


@dataclass(frozen=True, slots=True)
class Made:
    """A measure's numbers and drawing; without numbers, the reason."""

    quantities: tuple[Quantity, ...] = ()
    ends_m: FloatArray | None = None
    """(K, 3) as ``pipeline.measuring.measures.Measure`` has them, at the drawn surface's size."""
    ends: tuple[End, ...] = ()
    faces: tuple[Face, ...] = ()
    trouble: str = ""

    @property
    def guessed(self) -> bool:
        """Whether an end was guessed."""
        return any(one.guessed for one in self.quantities)


@dataclass(frozen=True, slots=True)
class ScaleView:
    """A true length compared with its measure."""

    factor: float = 1.0
    """Scale by it over that before."""
    ratio: float = 1.0
    """True over measured length."""
    agrees: bool = False
    """Whether the true length is inside the measure's interval."""
    trouble: str = ""
    """Why the measure sets no scale; else empty."""
    advice: str = ""
    """What to measure instead of a length that is known less well than the scale; else empty."""


@dataclass(frozen=True, slots=True)
class MeasureAnswer:
    """The answer to a ``MeasureRequest``."""

    request: MeasureRequest
    made: tuple[tuple[Taken, Made], ...]
    """The wanted measures, then those that the clicks completed."""
    completed: tuple[Taken, ...]
    """Measures that the clicks completed."""
    pending: Clicked
    """Points of the measure that is not complete after the clicks."""
    ends: tuple[End, ...]
    """The points of ``pending`` as they are drawn."""
    missed: str = ""
    """Why the last click gave no point; empty if it gave one."""
    scaled: ScaleView | None = None
    """By how much all lengths are scaled; None if they are not."""
    checked: ScaleView | None = None
    """Comparison for ``request.check``; None without one."""
    scale_source: str = ""
    """Sentence on the uncertainty of the scale."""
