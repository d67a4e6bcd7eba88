"""A procedural scene: solid parts with materials, lights, and the cameras that see it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from pipeline.types import CameraIntrinsics, FloatArray, IntArray

Rng = np.random.Generator
Texture = Callable[[FloatArray, FloatArray], FloatArray]
"""(N, 3) positions and (N, 3) normals in the part's own frame, metres -> (N, 3) linear albedo, 0 to 1."""


@dataclass(frozen=True, slots=True)
class Material:
    """The reflection of visible and infrared light by a surface."""

    texture: Texture
    """Albedo as a function of position and normal on the part, so meshes need no texture coordinates."""
    gloss: float = 0.0
    """Strength of the mirror-like reflection, 0 (chalk) to 1 (polished metal); at high gloss the sensor
    measures no depth."""
    infrared: float = 1.0
    """Infrared albedo relative to the visible luminance; black plastic and screens are near 0."""
    emission: float = 0.0
    """Emitted light in units of albedo (lamps, windows, screens)."""


@dataclass(frozen=True, slots=True)
class Part:
    """One solid with one material."""

    vertices_m: FloatArray
    """(V, 3) in the part's own frame, metres."""
    triangles: IntArray
    """(F, 3), counter-clockwise seen from outside."""
    material: Material
    T_world_part: FloatArray
    """(4, 4) transform from the part's frame to the world."""
    smooth: bool = False
    """Shade with interpolated vertex normals (spheres, cushions) instead of flat triangles."""


@dataclass(frozen=True, slots=True)
class Light:
    """A ball that emits light and casts soft shadows: a lamp, or the sky in a window."""

    position_m: FloatArray
    """(3,) centre, world frame."""
    color: FloatArray
    """(3,) linear RGB irradiance of a surface that faces the light at 1 m."""
    size_m: float = 0.1
    """Radius of the ball; a larger one makes softer shadows."""


@dataclass(frozen=True, slots=True)
class Scene:
    """Everything needed to render a rig with ground truth; the world frame has Z up."""

    name: str
    parts: tuple[Part, ...]
    lights: tuple[Light, ...]
    ambient: FloatArray
    """(3,) linear RGB of the light from all directions, dimmed by ambient occlusion."""
    cameras: tuple[FloatArray, ...]
    """True (4, 4) T_world_camera of every node."""
    intrinsics: CameraIntrinsics
    """Intrinsics of all cameras; in the uncalibrated demo those of its files, not the true ones."""
