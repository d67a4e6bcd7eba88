"""Measures between marks and planes of a surface, each with its 95 % interval."""

from __future__ import annotations

import numpy as np

from packetmesh.errors import InputError
from pipeline.measuring.boxes import box_of_part, box_of_planes
from pipeline.measuring.holes import hole_area
from pipeline.measuring.marks import Mark
from pipeline.measuring.planes import Plane
from pipeline.measuring.propagation import BENT_OF_SCALE, Places, interval
from pipeline.measuring.scale import ScaleCheck, declared, with_scale
from pipeline.measuring.surface import MeasuredSurface
from pipeline.measuring.values import Kind, Measure, Unit, Value
from pipeline.types import FloatArray

__all__ = [
    "Kind", "Measure", "ScaleCheck", "Unit", "Value", "angle", "angle_of_planes", "are_parallel",
    "box_of_part", "box_of_planes", "declared", "distance", "hole_area", "plane_to_plane", "point_to_plane",
    "with_scale",
]  # fmt: skip
SAME_M = 1e-6
"""Points closer than this are one point."""
PARALLEL_DEG = 10.0
"""Largest angle between planes that have a distance."""
SAME_PLANE_DEG = 1.0
"""Planes of a smaller angle that share vertices are one plane."""


def distance(surface: MeasuredSurface, a: Mark, b: Mark) -> Measure:
    """Return the length between two marks.

    Raises:
        InputError: both are the same point.
    """
    if np.linalg.norm(a.point_m - b.point_m) <= SAME_M:
        raise InputError("Both ends of the length are the same point; mark another one")
    value, ci95 = interval(surface, (a, b), _length)
    one = Value("length", value, "m", ci95, a.guessed or b.guessed)
    return Measure("distance", (one,), np.stack([a.point_m, b.point_m]))


def point_to_plane(surface: MeasuredSurface, a: Mark, plane: Plane) -> Measure:
    """Return the distance of a mark from a plane."""
    side = -1.0 if float((a.point_m - plane.point_m) @ plane.normal) < 0.0 else 1.0
    value, ci95 = interval(surface, (a, plane), lambda point, of: side * _height(point, of))
    foot_m = a.point_m - float((a.point_m - plane.point_m) @ plane.normal) * plane.normal
    one = Value("distance", value, "m", ci95, a.guessed or plane.guessed)
    return Measure("point-plane", (one,), np.stack([a.point_m, foot_m]))


def are_parallel(a: Plane, b: Plane) -> bool:
    """Return whether two planes are parallel enough to have a distance."""
    return _deg(abs(float(a.normal @ b.normal))) <= PARALLEL_DEG


def plane_to_plane(surface: MeasuredSurface, a: Plane, b: Plane) -> Measure:
    """Return the distance of two parallel planes, halfway between their centres.

    Raises:
        InputError: the planes are not parallel, or are one plane.
    """
    _check_two(a, b)
    if not are_parallel(a, b):
        apart_deg = _deg(abs(float(a.normal @ b.normal)))
        raise InputError(
            f"The planes are not parallel: {apart_deg:.0f} degrees apart; measure their angle, or the "
            "distance of a point from one of them"
        )
    value, ci95 = interval(surface, (a, b), _gap)
    middle_m, along = 0.5 * (a.point_m + b.point_m), _between(a.normal[None], b.normal[None])[0]
    ends_m = [
        middle_m + float((plane.point_m - middle_m) @ plane.normal) / float(along @ plane.normal) * along
        for plane in (a, b)
    ]
    one = Value("distance", value, "m", ci95, a.guessed or b.guessed)
    return Measure("plane-plane", (one,), np.stack(ends_m))


def angle(surface: MeasuredSurface, a: Mark, corner: Mark, b: Mark) -> Measure:
    """Return the angle at a corner between two marks, 0 to 180 degrees.

    Raises:
        InputError: a mark is at the corner.
    """
    for end in (a, b):
        if np.linalg.norm(end.point_m - corner.point_m) <= SAME_M:
            raise InputError("An end of the angle is at its corner; mark a point farther away")
    bent_deg = np.degrees(np.sqrt(2.0) * BENT_OF_SCALE * surface.tilting_sd)
    value, (low, high) = interval(surface, (a, corner, b), _corner_deg, float(bent_deg))
    guessed = a.guessed or corner.guessed or b.guessed
    one = Value("angle", value, "deg", (low, min(high, 180.0)), guessed)
    return Measure("angle", (one,), np.stack([a.point_m, corner.point_m, b.point_m]))


def angle_of_planes(surface: MeasuredSurface, a: Plane, b: Plane) -> Measure:
    """Return the angle between two planes, 0 to 180 degrees.

    It is the angle that their visible sides enclose at the corner of a room, and that of the solid at the
    edge of a thing: 180 degrees less the angle between the normals.

    Raises:
        InputError: both are one plane.
    """
    _check_two(a, b)
    value, (low, high) = interval(surface, (a, b), _dihedral_deg)
    one = Value("angle", value, "deg", (low, min(high, 180.0)), a.guessed or b.guessed)
    return Measure("angle", (one,), np.stack([a.point_m, _meeting_m(a, b), b.point_m]))


def _check_two(a: Plane, b: Plane) -> None:
    shared = len(np.intersect1d(a.rows, b.rows))
    if shared > 0.5 * min(len(a.rows), len(b.rows)) and _deg(float(a.normal @ b.normal)) < SAME_PLANE_DEG:
        raise InputError("Both points are on one plane; mark a point on another plane")


def _meeting_m(a: Plane, b: Plane) -> FloatArray:
    """Return the (3,) point of the planes' line nearest to halfway between them; halfway if parallel."""
    middle_m, line = 0.5 * (a.point_m + b.point_m), np.cross(a.normal, b.normal)
    if np.linalg.norm(line) < 1e-3:
        return middle_m
    heights_m = [a.normal @ a.point_m, b.normal @ b.point_m, line @ middle_m]
    return np.linalg.solve(np.stack([a.normal, b.normal, line]), heights_m)


def _length(a: Places, b: Places) -> FloatArray:
    return np.linalg.norm(a.points_m - b.points_m, axis=1)


def _height(point: Places, plane: Places) -> FloatArray:
    """Return (M,) heights over a plane, negative below: a magnitude would have no derivative at 0."""
    return np.einsum("mi,mi->m", point.points_m - plane.points_m, plane.normals)


def _between(normals: FloatArray, others: FloatArray) -> FloatArray:
    """Return (M, 3) unit directions halfway between (M, 3) normals, the others' signs turned to the first."""
    signs = np.where(np.einsum("mi,mi->m", normals, others) < 0.0, -1.0, 1.0)
    sums = normals + signs[:, None] * others
    return sums / np.linalg.norm(sums, axis=1, keepdims=True)


def _gap(a: Places, b: Places) -> FloatArray:
    """Return (M,) distances between planes along the direction halfway between their normals."""
    middle_m, along = 0.5 * (a.points_m + b.points_m), _between(a.normals, b.normals)
    ends = [
        np.einsum("mi,mi->m", plane.points_m - middle_m, plane.normals)
        / np.einsum("mi,mi->m", along, plane.normals)
        for plane in (a, b)
    ]
    return np.abs(ends[0] - ends[1])


def _corner_deg(a: Places, corner: Places, b: Places) -> FloatArray:
    one, other = a.points_m - corner.points_m, b.points_m - corner.points_m
    across = np.linalg.norm(np.cross(one, other), axis=1)
    return np.degrees(np.arctan2(across, np.einsum("mi,mi->m", one, other)))


def _dihedral_deg(a: Places, b: Places) -> FloatArray:
    across = np.linalg.norm(np.cross(a.normals, b.normals), axis=1)
    return np.degrees(np.arctan2(across, -np.einsum("mi,mi->m", a.normals, b.normals)))


def _deg(cosine: float) -> float:
    return float(np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0))))
