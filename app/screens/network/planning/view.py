"""Requests of the folder *Plan* and their answers, small enough to send."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TypeAlias

from app.compute.state import Sent
from pipeline.sources import RigFolder
from pipeline.types import BoolArray, ByteArray, FloatArray

Pose: TypeAlias = tuple[float, ...]
"""The 16 numbers of a (4, 4) pose, row by row; unlike an array, it can be part of a key."""
Poses: TypeAlias = tuple[Pose, ...]
"""Poses of all ghosts, in the order of the plan."""


@dataclass(frozen=True, slots=True)
class PlanRequest:
    """The cameras to plan, and how their images travel."""

    sent: Sent
    cameras: int
    where: tuple[str, ...]
    """Kinds of places, as in ``pipeline.planning.places``."""
    sensor: str
    """Name of the new cameras' sensor, as in ``pipeline.planning.sensors``."""
    budget_j: float | None
    deadline_s: float | None
    walls: str = "brick"
    """Material of the walls, as in ``pipeline.planning.walls``."""
    dark_surface: bool = True
    """Whether surface counts that looks dark to a present sensor."""


@dataclass(frozen=True, slots=True)
class PromiseView:
    """An expected gain and its 95 % interval, as shares of the present cameras' rays."""

    gain_share: float
    ci95_share: tuple[float, float]
    dark_share: float
    """Part of the gain on surface that looks dark, where a camera may get no depth."""


@dataclass(frozen=True, slots=True)
class Ghost:
    """A camera that is not there yet."""

    T_world_camera: FloatArray
    """(4, 4) pose."""
    where: str
    """Kind of place, or ``pipeline.planning.plan.BY_HAND``."""
    height_m: float
    """Above the floor."""
    promise: PromiseView
    """What it adds to the present cameras and to the ghosts before it."""
    overlap_share: float
    """Share of its image on measured surface that one present camera sees, too."""
    free: bool
    """Whether a present camera sees that its place is free."""
    newly: FloatArray
    """(T,) float32 chance that it measures each target, and no ghost before it does."""


@dataclass(frozen=True, slots=True)
class GhostsView:
    """All ghosts of a plan at their present poses."""

    ghosts: tuple[Ghost, ...]
    total: PromiseView


@dataclass(frozen=True, slots=True)
class Arrival:
    """The image of one ghost on its way to the sink; times are infinite for what never arrives."""

    seconds_to_90_s: float
    seconds_to_99_s: float
    joules: float


@dataclass(frozen=True, slots=True)
class PlanView:
    """A plan."""

    request: PlanRequest
    ghosts: GhostsView
    arrivals: tuple[Arrival, ...]
    targets_m: FloatArray
    """(T, 3) float32 places of the unmeasured rays, world frame."""
    dark: BoolArray
    """(T,) True where they look dark to a present sensor."""
    fov_rad: float
    """Vertical field of view of the new cameras."""
    aspect: float
    """Width over height of their images."""
    measured_share: float
    """Share of the present cameras' rays on measured surface."""
    floor_m: float
    """z of the floor, world frame."""
    present: Mapping[str, Pose]
    """Poses of the present cameras that are registered and switched on, by their names."""
    walls: int
    """Number of walls that damp the radio."""
    at_least_of_best: float
    candidates: int
    ruled_out: str
    """End of a sentence: that the radio or the deadline ruled out other candidates; empty if none were."""
    image_bytes: int
    """Bytes that count for an image of a new camera."""
    least_overlap: float
    """Least overlap with which registration finds a camera's pose."""
    notes: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class NoPlan:
    """Why there is no plan, and what to try."""

    sentence: str


@dataclass(frozen=True, slots=True)
class LookView:
    """What a ghost would see, and when the images of all ghosts arrive."""

    picture: ByteArray
    """(h, w, 3) picture of one ghost, drawn from the mesh."""
    arrivals: tuple[Arrival, ...]


@dataclass(frozen=True, slots=True)
class TakenView:
    """A camera that was added to the rig: what it promised and what it added."""

    source: RigFolder
    """The rig with the camera."""
    promise: PromiseView
    real_share: float
    """Share of the earlier cameras' rays that newly meet measured surface."""
    placed: bool
    """Whether registration found the camera's pose."""
