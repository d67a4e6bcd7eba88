"""What the app shows of the holes of a surface."""

from __future__ import annotations

from dataclasses import dataclass

from app.records import MeshView, Which
from pipeline.types import FloatArray


@dataclass(frozen=True, slots=True)
class HoleView:
    """One loop of edges that have one triangle only."""

    loop_m: FloatArray
    """(L, 3) float32, world frame, closed without repeating the first point; a hole's loop runs clockwise
    seen from outside."""
    length_m: float
    area_m2: float
    center_m: FloatArray
    """(3,)."""
    rim: bool
    """Whether the surface, or a piece that hangs on it by a point, ends there instead of having a hole."""


@dataclass(frozen=True, slots=True)
class ExplainView:
    """Why there is a hole, as ``pipeline.surface.hole_diagnosis.Explanation`` says it."""

    which: Which
    index: int
    """In that surface's holes."""
    reason: str
    sentence: str
    remedy: str
    closing_radius_m: float | None
    sensor_share: float
    """This and the other two: shares of the pixels that look into the hole; NaN if none does."""
    inferred_share: float
    unknown_share: float


@dataclass(frozen=True, slots=True)
class PartsView:
    """Where the pixel rays of all cameras end; shares with sum 1."""

    on_sensor: float
    """On surface that the sensor measured."""
    on_inferred: float
    """On surface that only inference made possible."""
    missed_measured: float
    """In no surface, though the sensor measured the pixel."""
    missed_inferred: float
    """In no surface; only inference has a depth for the pixel."""
    missed_unknown: float
    """In no surface, and nobody has a depth for the pixel."""


@dataclass(frozen=True, slots=True)
class FilledView:
    """The surface after fusion with its small holes filled."""

    mesh: MeshView
    """What was invented is drawn in its own colour; the numbers are those of the filled surface."""
    holes: int
    """How many were filled."""
    area_m2: float
    """Of what was invented."""
