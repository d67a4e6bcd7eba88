"""Requests and results of the Surface screen: surfaces, holes, balls and baselines."""

from __future__ import annotations

from collections.abc import Hashable, Mapping
from dataclasses import dataclass, field
from typing import ClassVar, Literal

from app.compute.records import MeshView
from pipeline.spec import Spec, key
from pipeline.surface.findings import Explanation, RayParts, Suggestion, SweepPoint
from pipeline.types import BoolArray, FloatArray, IntArray

Coloring = Literal["photo", "violet", "color", "source", "distance", "normal"]
"""The quantity that the colours of a surface show."""

Which = Literal["after", "before"]
"""The surface after or before fusion."""


@dataclass(frozen=True, slots=True)
class SpacingView:
    """The distances between the points over which the ball rolls."""

    r_F_m: float
    """Mean distance of the points from their nearest neighbours; ``sigma_D_m`` is its standard deviation."""
    sigma_D_m: float
    edges_m: FloatArray
    """(B + 1,) bin edges of the nearest-neighbour distance."""
    counts: IntArray
    """(B,) number of points."""


QUICK_POINTS = 20_000
"""Points of a quick look, if the browser draws fast enough."""


@dataclass(frozen=True, slots=True)
class Ray:
    """A line of sight in the frame of the surface."""

    origin_m: tuple[float, float, float]
    direction: tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class PaintRequest:
    """Surfaces to draw in these colours; with a radius, a quick look while the radius is dragged."""

    job: ClassVar[str] = "surface.paint_job:paint_job"
    """Address of the job that answers it."""
    which: tuple[Which, ...]
    coloring: Coloring
    radius_m: float | None = None
    """Radius of a quick look's ball; None takes the surfaces of the settings."""
    most_points: int = QUICK_POINTS
    """A quick look thins a larger cloud to about this number of points; to more if the ball is small."""

    def key(self, spec: Spec) -> tuple[Hashable, ...]:
        """Return the answer's cache key. A quick look depends on the spec's points, not on its radii."""
        return ("paint", self, key(spec, "after" if self.radius_m is None else "clouds"))


@dataclass(frozen=True, slots=True)
class PaintedMesh:
    """One surface to draw."""

    glb: bytes
    rims_glb: bytes
    triangles: int


@dataclass(frozen=True, slots=True)
class UnusedView:
    """Points that the ball left out."""

    measured_m: FloatArray
    """(N, 3) float32, world frame: points of the sensors."""
    inferred_m: FloatArray
    """(M, 3) float32, points of the depth network."""
    size_m: float
    """Size of a drawn point."""


@dataclass(frozen=True, slots=True)
class PaintedView:
    """The answer to a ``PaintRequest``."""

    request: PaintRequest
    meshes: dict[Which, PaintedMesh]
    points: int
    """Points over which the ball rolled, of the cloud after fusion or, if it is not shown, before."""
    all_points: int
    """Points of the whole cloud."""
    roll_s: float
    """Time of the ball alone."""
    unused: Mapping[Which, UnusedView] = field(default_factory=dict)
    """Left-out points of a quick look."""


@dataclass(frozen=True, slots=True)
class HoleView:
    """One loop of edges that belong to one triangle only."""

    loop_m: FloatArray
    """(L, 3) float32, world frame, closed without repeating the first point; a hole's loop runs clockwise
    seen from outside."""
    length_m: float
    area_m2: float
    center_m: FloatArray
    """(3,) centre."""
    rim: bool
    """Whether it is the outer rim of the surface, or of a piece attached by a point, not a hole."""


@dataclass(frozen=True, slots=True)
class ExplainView:
    """The cause of a hole."""

    which: Which
    index: int
    """Index in that surface's holes."""
    found: Explanation


@dataclass(frozen=True, slots=True)
class ClosingCamera:
    """The camera that would measure most of a hole."""

    T_world_camera: FloatArray
    """(4, 4) pose."""
    where: str
    """Kind of place, as in ``pipeline.planning.places``."""
    height_m: float
    """Above the floor."""
    share: float
    """Share of the hole that it would measure."""
    dark_share: float
    """Part of that share where the hole looks dark to a present sensor, and may stay without depth."""
    overlap_share: float
    """Share of its image on measured surface that one present camera sees, too."""
    fov_rad: float
    """Vertical field of view."""
    aspect: float
    """Width over height."""
    points_m: FloatArray
    """(T, 3) float32 points of the hole, world frame."""
    chance: FloatArray
    """(T,) float32 chance that it measures each of them."""
    dark: BoolArray
    """(T,) True where they look dark to a present sensor."""


@dataclass(frozen=True, slots=True)
class ClosingView:
    """The camera that would close a hole."""

    which: Which
    index: int
    """Index in that surface's holes."""
    camera: ClosingCamera | None
    why_none: str = ""
    """Why there is no such camera, and what to try."""


@dataclass(frozen=True, slots=True)
class FilledView:
    """The surface after fusion with its small holes filled."""

    mesh: MeshView
    """Invented triangles have their own colour; the numbers are those of the filled surface."""
    holes: int
    """Number of filled holes."""
    area_m2: float
    """Area of the invented triangles."""


@dataclass(frozen=True, slots=True)
class SweepView:
    """The balls of a sweep; while it runs, those that are done."""

    points: tuple[SweepPoint, ...]
    """By ascending radius."""
    r_F_m: float
    sigma_D_m: float
    planned: int
    """Number of balls of the whole sweep."""

    @property
    def done(self) -> bool:
        """Whether all balls are done."""
        return len(self.points) == self.planned


BaselineName = Literal["poisson", "alpha"]


@dataclass(frozen=True, slots=True)
class BaselineView:
    """The surface of another method over the same points, for comparison with the ball's."""

    name: BaselineName
    mesh: MeshView
    elapsed_s: float
    """Time from the cloud to the surface, without the measurements."""
    note: str
    """One sentence on the method and its parameters."""


@dataclass(frozen=True, slots=True)
class SurfaceView:
    """The surfaces before and after fusion; while they are computed, a partial result."""

    spacing: SpacingView
    radii_m: tuple[float, ...]
    after: MeshView
    before: MeshView | None
    elapsed_s: float
    """Time from the clouds to the surface after fusion."""
    holes: Mapping[Which, tuple[HoleView, ...]] = field(default_factory=dict)
    """Holes of both surfaces; empty in a partial result."""
    parts: RayParts | None = None
    """Shares of the pixel rays by where they end on the surface after fusion."""
    suggestions: tuple[Suggestion, ...] = ()
    """Ball radii that the cloud after fusion suggests."""
    unused: Mapping[Which, UnusedView] = field(default_factory=dict)
    """Left-out points of the surfaces computed so far."""
