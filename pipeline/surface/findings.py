"""Records of results about a surface, which screens and scripts read without computing anything."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

SEAM_M = 0.15
"""Longest loop of a hole that is closed in pictures with photo textures. Measured on living room, office
and box on table at 30,000 points: 15, 13 and 6 % fewer rays miss, and the F-score at 5 cm changes by -0.01
to +0.05 points."""
Reason = Literal["gap", "normals", "no points", "outside view"]


@dataclass(frozen=True, slots=True)
class RayParts:
    """Shares of all pixel rays; they add up to 1, and all are NaN without a view."""

    on_sensor: float
    """Rays that hit a triangle of measured points."""
    on_inferred: float
    """Rays that hit a triangle most of whose corners were inferred."""
    missed_measured: float
    """Rays that hit nothing, at pixels where the sensor measured a depth."""
    missed_inferred: float
    """Rays that hit nothing, at pixels where only the depth network gives a depth."""
    missed_unknown: float
    """Rays that hit nothing, at pixels without any depth."""


@dataclass(frozen=True, slots=True)
class Kept:
    """Agreement of the surface with the measurements, without truth. Shares of 0 to 1 over all nodes."""

    kept_share: float
    """Share of the measured pixels that the outlier filter keeps."""
    within_2pct_before: float
    """Share of the measured pixels whose ray hits the surface within 2 % of the measurement, before fusion
    (surface of the sensors' points alone)."""
    within_2pct_after: float
    """Share of the measured pixels whose ray hits the surface after fusion within 2 % of the measurement."""
    within_5pct_before: float
    within_5pct_after: float
    measured_ray_share: float
    """Share of all pixel rays that, after fusion, hit a triangle of measured points."""
    guessed_ray_share: float
    """Share of all pixel rays that, after fusion, hit a triangle most of whose corners were inferred."""


@dataclass(frozen=True, slots=True)
class Explanation:
    """Cause of a hole and its remedy."""

    reason: Reason
    sentence: str
    remedy: str
    closing_radius_m: float | None
    """Smallest tried ball that closes the hole when it rolls after the surface's balls; None if none does."""
    sensor_share: float
    """Share of the hole's pixels, in all cameras that see it, with measured depth; NaN without pixels."""
    inferred_share: float
    """Share of these pixels with only the network's depth."""
    unknown_share: float
    """Share of these pixels without any depth."""


@dataclass(frozen=True, slots=True)
class Suggestion:
    """A suggested ball radius and the share of the surface that it closes."""

    name: str
    radius_m: float
    share: float
    """Share of the sampled surface points, without borders, around which this ball closes the triangles."""
    sentence: str


@dataclass(frozen=True, slots=True)
class SweepPoint:
    """Measures of the surface that one ball radius makes."""

    radius_m: float
    triangles: int
    unused_share: float
    """Share of the points that no triangle uses."""
    hole_area_m2: float
    """Area of the holes, as ``SurfaceQuality.hole_area_m2`` (SPEC 5)."""
    no_hit_ray_share: float
    """Rays without a surface: share of the cameras' pixel rays, 0 to 1; NaN without cameras."""
    accuracy_1cm: float
    """Share of the surface within 1 cm of the truth; NaN without truth or without a triangle."""
    f_score_5cm: float
    """F-score at 5 cm; NaN without truth or without a triangle."""
    elapsed_s: float
    """Run time of the ball pivoting alone."""
