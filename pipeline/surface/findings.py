"""What is found out about a surface: records that a screen or a script reads without computing anything."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

SEAM_M = 0.15
"""Longest loop of a hole that is closed for a picture in photographs. Measured on living room, office and
box on table at 30,000 points: 15, 13 and 6 % fewer rays miss, and the F-score at 5 cm changes by -0.01 to
+0.05 points."""
Reason = Literal["gap", "normals", "no points", "outside view"]


@dataclass(frozen=True, slots=True)
class RayParts:
    """Shares of all pixel rays; they add up to 1, and all are NaN without a view."""

    on_sensor: float
    """Rays that meet a triangle of the sensor's points."""
    on_inferred: float
    """Rays that meet a triangle most of whose corners were inferred."""
    missed_measured: float
    """Rays that meet nothing though the sensor measured there."""
    missed_inferred: float
    """Rays that meet nothing where only the network knows a depth."""
    missed_unknown: float
    """Rays that meet nothing where nobody knows a depth."""


@dataclass(frozen=True, slots=True)
class Kept:
    """What became of the measurements; no truth is needed. Shares of 0 to 1 over all nodes."""

    kept_share: float
    """Of the measured pixels, those that the outlier filter keeps."""
    within_2pct_before: float
    """Of the measured pixels, those whose ray meets the surface before fusion, of the sensors' points alone,
    within 2 % of the measurement."""
    within_2pct_after: float
    """The same of the surface after fusion."""
    within_5pct_before: float
    within_5pct_after: float
    measured_ray_share: float
    """Of all pixel rays, those that after fusion meet a surface of measured points."""
    guessed_ray_share: float
    """Of all pixel rays, those that after fusion meet a triangle most of whose corners were inferred."""


@dataclass(frozen=True, slots=True)
class Explanation:
    """Why a hole is there and what would close it."""

    reason: Reason
    sentence: str
    remedy: str
    closing_radius_m: float | None
    """The smallest ball tried that closes it when it rolls after the surface's own; None if none did."""
    sensor_share: float
    """Share of the hole's pixels, in all cameras that see it, where the sensor measured; NaN without any."""
    inferred_share: float
    """Share of those where only the network's depth is known."""
    unknown_share: float
    """Share of those where neither is."""


@dataclass(frozen=True, slots=True)
class Suggestion:
    """A ball radius and what it does to this cloud."""

    name: str
    radius_m: float
    share: float
    """Share of the sampled surface points, borders left out, whose fan of triangles this ball closes."""
    sentence: str


@dataclass(frozen=True, slots=True)
class SweepPoint:
    """The surface that one ball leaves."""

    radius_m: float
    triangles: int
    unused_share: float
    """Share of the points that no triangle uses."""
    hole_area_m2: float
    """Of the loops shorter than 1 m, without the outer loop of each part (SPEC 5)."""
    no_hit_ray_share: float
    """Share of the cameras' pixel rays that miss the surface; NaN without cameras."""
    accuracy_1cm: float
    """Share of the surface within 1 cm of the truth; NaN without truth or without a triangle."""
    f_score_5cm: float
    """NaN without truth or without a triangle."""
    elapsed_s: float
    """Of the ball alone."""
