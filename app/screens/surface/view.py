"""What the Surface screen gets of surfaces, their holes, balls and baselines."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

from app.compute.records import MeshView
from pipeline.surface.findings import Explanation, RayParts, Suggestion, SweepPoint
from pipeline.types import FloatArray, IntArray

Coloring = Literal["photo", "violet", "color", "source", "distance", "normal"]
"""What the colours of a surface mean."""

Which = Literal["after", "before"]
"""Fusion."""


@dataclass(frozen=True, slots=True)
class SpacingView:
    """How far apart the points are that the ball rolls over."""

    r_F_m: float
    sigma_D_m: float
    edges_m: FloatArray
    """(B + 1,) bins of the nearest-neighbour distance."""
    counts: IntArray
    """(B,)."""


QUICK_POINTS = 20_000
"""Of a quick look, where the browser draws fast enough."""


@dataclass(frozen=True, slots=True)
class Ray:
    """A line of sight in the frame of the surface."""

    origin_m: tuple[float, float, float]
    direction: tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class PaintRequest:
    """Surfaces to draw in certain colours; with a radius, a quick look while the ball is being chosen."""

    which: tuple[Which, ...]
    coloring: Coloring
    radius_m: float | None = None
    """None takes the surfaces of the settings as they are."""
    most_points: int = QUICK_POINTS
    """A larger cloud is thinned to about so many for a quick look."""
    ray: Ray | None = None
    """Where it meets the cloud, the ball of a quick look lies."""


@dataclass(frozen=True, slots=True)
class PaintedMesh:
    """One surface to draw."""

    glb: bytes
    rims_glb: bytes
    vertices: int
    triangles: int


@dataclass(frozen=True, slots=True)
class UnusedView:
    """Points that the ball left out."""

    measured_m: FloatArray
    """(N, 3) float32, world frame: those of the sensors."""
    inferred_m: FloatArray
    """(M, 3) float32, those of the depth network."""
    size_m: float
    """Of a point on the screen."""


@dataclass(frozen=True, slots=True)
class PaintedView:
    """The answer to a ``PaintRequest``."""

    request: PaintRequest
    meshes: dict[Which, PaintedMesh]
    points: int
    """That the ball rolled over, of the cloud after fusion or, if that is not shown, before."""
    all_points: int
    """Of the whole cloud."""
    roll_s: float
    """The ball alone."""
    unused: Mapping[Which, UnusedView] = field(default_factory=dict)
    """Of a quick look."""
    ball_m: FloatArray | None = None
    """(3,) centre of the ball of a quick look, at rest on a point."""


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
    """Why there is a hole."""

    which: Which
    index: int
    """In that surface's holes."""
    found: Explanation


@dataclass(frozen=True, slots=True)
class FilledView:
    """The surface after fusion with its small holes filled."""

    mesh: MeshView
    """What was invented is drawn in its own colour; the numbers are those of the filled surface."""
    holes: int
    """How many were filled."""
    area_m2: float
    """Of what was invented."""


@dataclass(frozen=True, slots=True)
class SweepView:
    """The balls of a sweep; while it runs, those that have rolled."""

    points: tuple[SweepPoint, ...]
    """By radius, ascending."""
    r_F_m: float
    sigma_D_m: float
    planned: int
    """How many balls there will be."""

    @property
    def done(self) -> bool:
        """Whether all of them have rolled."""
        return len(self.points) == self.planned


BaselineName = Literal["poisson", "alpha"]


@dataclass(frozen=True, slots=True)
class BaselineView:
    """The surface of another method over the same points, to hold the ball's against."""

    name: BaselineName
    mesh: MeshView
    elapsed_s: float
    """From the cloud to the surface, without the measures."""
    note: str
    """One sentence on the method and its parameters."""


@dataclass(frozen=True, slots=True)
class SurfaceView:
    """The surfaces before and after fusion; while they are computed, only what is there so far."""

    spacing: SpacingView
    radii_m: tuple[float, ...]
    after: MeshView
    before: MeshView | None
    elapsed_s: float
    """From the clouds to the surface after fusion."""
    holes: Mapping[Which, tuple[HoleView, ...]] = field(default_factory=dict)
    """Of both surfaces, at the end."""
    parts: RayParts | None = None
    """Of the surface after fusion."""
    suggestions: tuple[Suggestion, ...] = ()
    """Ball radii that the cloud after fusion suggests."""
    unused: Mapping[Which, UnusedView] = field(default_factory=dict)
    """Of the surfaces that are there."""
