"""Points that a person marks on a surface, with their covariance."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from packetmesh.errors import InputError
from pipeline.measuring.lookup import Spot, lookup_of
from pipeline.measuring.near import spot_near
from pipeline.measuring.planes import BORDER, Plane, plane_at
from pipeline.measuring.surface import MeasuredSurface
from pipeline.types import FloatArray

Snap = Literal["surface", "vertex", "edge", "plane"]
BRIDGE_COSINE = 0.5
"""Cosine between the normals of a triangle and of its corners below which it bridges two surfaces."""
RAGGED_COSINE = 0.87
"""Cosine of the corners' normals below which a triangle bridges a crease."""
OTHER_FACE_COSINE = 0.8
"""Cosine of two normals below which they are of different planes that meet at an edge."""
EDGE_SPACINGS = 5.0
"""An edge or a corner is looked for within this many spacings."""
NEAREST = 200
"""Most vertices from which its planes are grown."""
BESIDE_LINE, GAP = 2.0, 3.0
"""Spacings: vertices within the first distance of a line show how far it goes. A wider gap than the second
interrupts the line, and a plane whose nearest vertex is farther from a corner does not reach it."""
LEAST_VOLUME = 0.2
"""Least volume that the unit normals of three planes span; flatter corners are open along a line."""


@dataclass(frozen=True, slots=True)
class Mark:
    """A point on a surface, chosen by a person."""

    point_m: FloatArray
    """(3,) world frame."""
    covariance_m2: FloatArray
    """(3, 3) of the point's own noise and of the choice, without pose and scale; of a guessed point the
    choice alone."""
    normal: FloatArray
    """(3,) unit, towards the observer."""
    snapped: Snap
    node: int
    """Node that measured it; -1 if several or unknown."""
    guessed: bool
    ray: FloatArray | None = None
    """(3,) unit direction from the camera to the point."""
    range_m: float = float("nan")
    """Distance from that camera; NaN if unknown."""
    confidence: float = float("nan")
    """Confidence of a guess, 0 to 1; NaN if unknown or measured."""


def mark(surface: MeasuredSurface, point_m: FloatArray, snap: Snap = "surface") -> Mark:
    """Return the point of a surface that is nearest to a given point.

    The distance of the given point from the surface counts as standard deviation in that direction, unless
    planes determine the mark.

    Args:
        surface: the surface.
        point_m: (3,) world frame.
        snap: ``vertex`` moves it to the corner of the planes near it, else to the nearest vertex; ``edge`` to
            the nearest line in which two planes meet, ``plane`` onto the plane that fits there.

    Raises:
        InputError: nothing of the surface is near the point, or there is no edge or plane.
    """
    spot = spot_near(surface, point_m)
    shift_m = np.asarray(point_m, float) - spot.point_m
    return _snapped(surface, spot, snap, None, np.outer(shift_m, shift_m))


def mark_on_ray(
    surface: MeasuredSurface, origin_m: FloatArray, direction: FloatArray, snap: Snap = "surface"
) -> Mark:
    """Return the first point of a surface that a click's ray meets; arguments as for ``mark``.

    Raises:
        InputError: the ray misses the surface, or there is no edge or plane.
    """
    direction = np.asarray(direction, float)
    spot = lookup_of(surface).first_on(np.asarray(origin_m, float), direction)
    if spot is None:
        raise InputError("There is no surface under the pointer; click on the surface")
    return _snapped(surface, spot, snap, direction / np.linalg.norm(direction), np.zeros((3, 3)))


def _snapped(
    surface: MeasuredSurface, spot: Spot, snap: Snap, ray: FloatArray | None, choice_m2: FloatArray
) -> Mark:
    """Return the mark at a place.

    Args:
        surface: the surface.
        spot: the place.
        snap: how it is moved.
        ray: (3,) direction in which a person looks at it, if known.
        choice_m2: (3, 3) covariance of the given place, which counts unless planes give the mark.
    """
    own = _on_surface(surface, spot)
    if snap == "vertex":
        row = spot.corners[[int(np.argmax(spot.shares))]]
        nearest = _on_surface(surface, Spot(surface.vertices_m[row[0]], row, np.ones(1)))
        nearest = replace(nearest, snapped=snap, covariance_m2=nearest.covariance_m2 + choice_m2)
        return _on_corner(surface, own) or nearest
    if snap == "plane":
        return _on_plane(own, plane_at(surface, spot.point_m), ray)
    if snap == "edge":
        return _on_edge(surface, own)
    return replace(own, covariance_m2=own.covariance_m2 + choice_m2)


def _on_surface(surface: MeasuredSurface, spot: Spot) -> Mark:
    """Return the mark at a place as it is.

    The choice adds half a spacing in the surface's plane where the surface itself is ragged: at its rim and
    where a triangle bridges a crease. There it also adds, along the normal, half of what the triangle cuts
    off the crease. On a triangle between two surfaces it adds half of its depth.
    """
    rows, shares = spot.corners, spot.shares
    normal = _unit(shares @ surface.normals[rows], surface.normals[rows[0]])
    ray = _unit(shares @ surface.rays[rows], normal)
    guessed = bool(np.sum(surface.guessed[rows]) > 0.5 * len(rows))
    covariance_m2: FloatArray = np.zeros((3, 3))
    if not guessed:
        covariance_m2 = float(shares @ surface.sigma_m[rows] ** 2) * np.outer(ray, ray)
    lookup = lookup_of(surface)
    cosine = float(np.clip(np.min(surface.normals[rows] @ surface.normals[rows].T), -1.0, 1.0))
    along = np.outer(normal, normal)
    if len(rows) == 3 and (cosine < RAGGED_COSINE or np.sum(lookup.rim[rows]) >= 2):
        covariance_m2 = covariance_m2 + (0.5 * lookup.spacing_m) ** 2 * (np.eye(3) - along)
    if len(rows) == 3 and cosine < RAGGED_COSINE:
        cut_m = 0.5 * lookup.spacing_m * np.sqrt((1.0 - cosine) / (1.0 + max(cosine, 0.0)))
        covariance_m2 = covariance_m2 + (0.5 * cut_m) ** 2 * along
    if len(rows) == 3:
        corners_m = surface.vertices_m[rows]
        facing = _unit(np.cross(corners_m[1] - corners_m[0], corners_m[2] - corners_m[0]), normal)
        if abs(float(facing @ normal)) < BRIDGE_COSINE:
            covariance_m2 = covariance_m2 + (0.5 * float(np.ptp(corners_m @ ray))) ** 2 * np.outer(ray, ray)
    nodes = surface.nodes[rows]
    confidence = range_m = float("nan")
    if surface.ranges_m is not None:
        range_m = float(shares @ surface.ranges_m[rows])
    if guessed and surface.confidence is not None and np.isfinite(surface.confidence[rows]).any():
        confidence = float(np.nanmean(surface.confidence[rows]))
    return Mark(
        spot.point_m,
        covariance_m2,
        normal,
        "surface",
        int(nodes[0]) if np.all(nodes == nodes[0]) else -1,
        guessed,
        ray,
        range_m,
        confidence,
    )


def _on_plane(own: Mark, plane: Plane, ray: FloatArray | None) -> Mark:
    """Move a mark onto a plane, along the ray of a click or else along the normal."""
    along = plane.normal if ray is None or abs(ray @ plane.normal) < 0.1 else ray
    height_m = float((plane.point_m - own.point_m) @ plane.normal) / float(along @ plane.normal)
    point_m = own.point_m + height_m * along
    shift = along / float(along @ plane.normal)
    covariance_m2 = plane.offset_variance_m2(point_m) * np.outer(shift, shift)
    return replace(
        own,
        point_m=point_m,
        covariance_m2=covariance_m2,
        normal=plane.normal,
        snapped="plane",
        node=plane.node,
    )


def _on_edge(surface: MeasuredSurface, own: Mark) -> Mark:
    """Move a mark to the nearest point of the line in which the planes on both sides of a crease meet."""
    planes = _faces_near(surface, own, 2)
    found = None
    if len(planes) == 2:
        line = _line_of(planes)
        found = _where_meeting(surface, own, planes, line, float(line @ own.point_m), 0.0)
    if found is None:
        raise InputError("No edge is near the marked point; try a point closer to where two flat parts meet")
    return replace(found, snapped="edge")


def _on_corner(surface: MeasuredSurface, own: Mark) -> Mark | None:
    """Move a mark to the point in which three planes near it meet, or two end; None if there is none.

    Where the third face of a corner was not seen, the vertices of the other two stop short of the corner,
    within the planes' rounded border: their line is taken to go on by half of that border.
    """
    planes = _faces_near(surface, own, 3)
    corner = _where_meeting(surface, own, planes) if len(planes) == 3 else None
    if corner is not None or len(planes) < 2:
        return corner
    planes = planes[:2]
    line, rounded_m = _line_of(planes), BORDER * lookup_of(surface).spacing_m
    end_m = _end_m(surface, planes, line, float(line @ own.point_m), 0.5 * rounded_m)
    return _where_meeting(surface, own, planes, line, end_m, rounded_m / np.sqrt(12.0))


def _line_of(planes: list[Plane]) -> FloatArray:
    """Return the (3,) unit direction of the line in which two planes meet; 0 for parallel ones."""
    return _unit(np.cross(planes[0].normal, planes[1].normal), np.zeros(3))


def _end_m(
    surface: MeasuredSurface, planes: list[Plane], line: FloatArray, own_m: float, on_m: float
) -> float:
    """Return the coordinate along a line of two planes at which it ends, ``on_m`` beyond the last vertex.

    Of several ends it is the one nearest to ``own_m``; infinite if there is none.
    """
    spacing_m = lookup_of(surface).spacing_m
    points_m = surface.vertices_m[np.union1d(planes[0].rows, planes[1].rows)]
    off_m = [np.abs((points_m - plane.point_m) @ plane.normal) for plane in planes]
    along_m = np.sort(points_m[np.maximum(*off_m) <= BESIDE_LINE * spacing_m] @ line)
    if not len(along_m):
        return np.inf
    gaps = np.flatnonzero(np.diff(along_m) > GAP * spacing_m)
    firsts_m, lasts_m = along_m[[0, *gaps + 1]], along_m[[*gaps, -1]]
    ends_m, outwards = np.concatenate([firsts_m, lasts_m]), np.repeat([-1.0, 1.0], len(gaps) + 1)
    nearest = int(np.argmin(np.abs(ends_m - own_m)))
    return float(ends_m[nearest] + on_m * outwards[nearest])


def _faces_near(surface: MeasuredSurface, own: Mark, count: int) -> list[Plane]:
    """Return up to ``count`` planes of different directions around a mark, the nearest first."""
    lookup = lookup_of(surface)
    near = lookup.tree.nearest(own.point_m[None], min(NEAREST, len(surface.vertices_m)))[1][0]
    away_m = np.linalg.norm(surface.vertices_m[near] - own.point_m, axis=1)
    planes: list[Plane] = []
    for row in near[away_m <= EDGE_SPACINGS * lookup.spacing_m]:
        if len(planes) == count:
            break
        if any(surface.normals[row] @ plane.normal > OTHER_FACE_COSINE for plane in planes):
            continue
        try:
            plane = plane_at(surface, surface.vertices_m[row])
        except InputError:
            continue
        if all(plane.normal @ other.normal < OTHER_FACE_COSINE for other in planes):
            planes.append(plane)
    return planes


def _where_meeting(
    surface: MeasuredSurface,
    own: Mark,
    planes: list[Plane],
    line: FloatArray | None = None,
    along_m: float = 0.0,
    along_sd_m: float = 0.0,
) -> Mark | None:
    """Return the mark where planes meet; None if that is too far away, open, or beyond the end of one.

    Args:
        surface: the surface.
        own: the mark before.
        planes: three planes, or two and their line.
        line: (3,) unit direction of the line.
        along_m: coordinate of the mark along it.
        along_sd_m: standard deviation of this coordinate.
    """
    across = np.stack([plane.normal for plane in planes])
    heights_m = [float(plane.normal @ plane.point_m) for plane in planes]
    if line is not None:
        across, heights_m = np.vstack([across, line]), [*heights_m, along_m]
    if abs(float(np.linalg.det(across))) < LEAST_VOLUME or not np.isfinite(heights_m).all():
        return None
    back = np.linalg.inv(across)
    point_m = back @ np.array(heights_m)
    spacing_m = lookup_of(surface).spacing_m
    if np.linalg.norm(point_m - own.point_m) > EDGE_SPACINGS * spacing_m:
        return None
    parts_m = [surface.vertices_m[plane.rows] for plane in planes]
    if any(np.linalg.norm(part_m - point_m, axis=1).min() > GAP * spacing_m for part_m in parts_m):
        return None
    variances_m2 = [plane.offset_variance_m2(point_m) for plane in planes]
    if line is not None:
        variances_m2.append(along_sd_m**2)
    nodes = {plane.node for plane in planes}
    return replace(
        own,
        point_m=point_m,
        covariance_m2=back @ np.diag(variances_m2) @ back.T,
        normal=_unit(np.sum([plane.normal for plane in planes], axis=0), own.normal),
        snapped="vertex",
        node=nodes.pop() if len(nodes) == 1 else -1,
        guessed=any(plane.guessed for plane in planes),
    )


def _unit(vector: FloatArray, fallback: FloatArray) -> FloatArray:
    length = float(np.linalg.norm(vector))
    return vector / length if length > 1e-9 else fallback
