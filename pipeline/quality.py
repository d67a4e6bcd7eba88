"""Measures of a mesh: its holes, gaps and validity."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Gaps:
    """Gaps in a mesh, counted in each camera's image; an image without any of the mesh has none."""

    count: int
    """Connected groups of pixels whose rays miss the mesh, of any size."""
    large: int
    """Groups of 100 cm² or more."""
    area_m2: float
    """Area of all groups, as if each pixel faced the camera at the depth of the nearest pixel that hits."""


@dataclass(frozen=True, slots=True)
class SurfaceQuality:
    """Measures of a mesh's holes and validity (SPEC 5); ``no_hit_ray_share`` is the main one."""

    no_hit_ray_share: float
    """Rays without a surface: share of the cameras' pixel rays that meet no triangle, 0 to 1."""
    boundary_loops: int
    """Holes and outer rims: number of connected components of the graph of edges with exactly one face."""
    boundary_length_m: float
    hole_area_m2: float
    """Area of the holes: loops under 1 m, without each component's longest loop and islands (``Hole``)."""
    non_manifold_edges: int
    """Edges with more than two faces."""
    components: int
    area_m2: float
    unused_points: int
    """Input points that no triangle uses."""
    within_2pct_share: float = float("nan")
    """Share of the measured pixels whose ray meets the mesh within 2 % of the depth; NaN without depth."""
    within_5pct_share: float = float("nan")
    """The same share within 5 %."""
    guessed_ray_share: float = float("nan")
    """Share of the pixel rays that meet a triangle with two or three inferred corners; NaN if unknown."""
    gaps: Gaps | None = None
    """Gaps as groups of pixels; None without cameras."""
