"""Cuts that leave a part of the scene out of the picture: which points and which parts of a ray they keep."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from pipeline.types import BoolArray, FloatArray

Place: TypeAlias = tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class Top:
    """Cut off the part of the scene above a height."""

    height_m: float


@dataclass(frozen=True, slots=True)
class Plane:
    """Cut off the part of the scene behind a plane."""

    point_m: Place
    normal: Place
    """Unit vector to the side that is kept."""


@dataclass(frozen=True, slots=True)
class Box:
    """Cut off the part of the scene outside a box, or the part inside."""

    centre_m: Place
    size_m: Place
    turn_deg: float = 0.0
    """Turn about the vertical through its centre, counter-clockwise as seen from above."""
    inside: bool = False
    """Whether the inside is cut off instead of the outside."""


Cut: TypeAlias = Top | Plane | Box | None


def planes_of(cut: Cut) -> list[tuple[FloatArray, FloatArray]]:
    """Return the planes of a cut, each as a point (3,) and a unit normal (3,). Normals point to the kept
    side; those of a box point to its inside, even if the inside is cut off.
    """
    if isinstance(cut, Top):
        return [(np.array([0.0, 0.0, cut.height_m]), np.array([0.0, 0.0, -1.0]))]
    if isinstance(cut, Plane):
        return [(np.array(cut.point_m), np.array(cut.normal))]
    if isinstance(cut, Box):
        centre_m, axes = np.array(cut.centre_m), box_axes(cut)
        return [
            (centre_m + 0.5 * side * cut.size_m[row] * axes[row], -side * axes[row])
            for row in range(3)
            for side in (-1.0, 1.0)
        ]
    return []


def box_axes(box: Box) -> FloatArray:
    """Return (3, 3): each row is the direction of one of the box's edges."""
    turn = np.radians(box.turn_deg)
    return np.array([[np.cos(turn), np.sin(turn), 0.0], [-np.sin(turn), np.cos(turn), 0.0], [0.0, 0.0, 1.0]])


def kept(cut: Cut, points_m: FloatArray) -> BoolArray:
    """Return (N,) whether each of (N, 3) points is kept."""
    sides = [(points_m - point_m) @ normal >= 0.0 for point_m, normal in planes_of(cut)]
    within = np.logical_and.reduce(sides) if sides else np.ones(len(points_m), bool)
    return ~within if isinstance(cut, Box) and cut.inside else within


def kept_on_ray(cut: Cut, origin_m: FloatArray, direction: FloatArray) -> list[tuple[float, float]]:
    """Return the parts of a ray that are kept, in order: begin and end of each, in lengths of the direction.

    Args:
        cut: the cut.
        origin_m: (3,) origin of the ray.
        direction: (3,) direction of the ray, of any length.
    """
    begin, end = 0.0, np.inf
    for point_m, normal in planes_of(cut):
        away_m, slope = float((origin_m - point_m) @ normal), float(direction @ normal)
        if slope > 0.0:
            begin = max(begin, -away_m / slope)
        elif slope < 0.0:
            end = min(end, -away_m / slope)
        elif away_m < 0.0:
            end = -1.0
    parts = [(begin, end)]
    if isinstance(cut, Box) and cut.inside:
        parts = [(0.0, begin), (end, np.inf)] if begin < end else [(0.0, np.inf)]
    return [(first, last) for first, last in parts if first < last]
